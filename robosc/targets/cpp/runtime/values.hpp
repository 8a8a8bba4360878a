/* Between the model's data and fields of messages. Which fields a message has, only the compiler knows: a field that
   is missing, or of another kind than the model says, is an error of the compiler. */

#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "json.hpp"

namespace robosc {

/* A value that the field of a message cannot hold: the request is not issued. */
class Misfit : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/* Memory for the received data of one message: taken piece by piece, given back at once. */
class Arena {
public:
    template <class T>
    T* take(std::size_t count)
    {
        static_assert(std::is_trivially_destructible<T>::value, "received data is plain C");
        const std::size_t bytes = (count > 0 ? count : 1) * sizeof(T);
        blocks_.push_back(std::make_unique<std::max_align_t[]>(bytes / sizeof(std::max_align_t) + 1));
        auto* const place = reinterpret_cast<unsigned char*>(blocks_.back().get());
        for (std::size_t k = 0; k < count; k++) {
            new (place + k * sizeof(T)) T();
        }
        return reinterpret_cast<T*>(place);
    }

private:
    std::vector<std::unique_ptr<std::max_align_t[]>> blocks_;
};

/* ROS 1 stores a bool in a byte in C++. */
template <class T>
inline constexpr bool is_boolean = std::is_same<T, bool>::value || std::is_same<T, std::uint8_t>::value;

template <class T>
inline constexpr bool is_integer = std::is_integral<T>::value && !std::is_same<T, bool>::value
    && !std::is_same<T, char16_t>::value && !std::is_same<T, wchar_t>::value;

template <class T>
inline constexpr bool is_text = std::is_convertible<T, std::string>::value;

namespace detail {

template <class M, class = void>
struct HasData : std::false_type {};
template <class M>
struct HasData<M, std::void_t<decltype(std::declval<M&>().data)>> : std::true_type {};

template <class M, class = void>
struct HasHeader : std::false_type {};
template <class M>
struct HasHeader<M, std::void_t<decltype(std::declval<M&>().header.frame_id)>> : std::true_type {};

}  // namespace detail

/* The field that stands for a basic type: `data`, else the only one. */
template <class M>
decltype(auto) basic_field(M& message)
{
    if constexpr (detail::HasData<M>::value) {
        return (message.data);
    } else {
        auto& [only_field] = message;
        return (only_field);
    }
}

/* Checks that a field is of the kind that the model says. */

template <class F>
void require_boolean(const F&)
{
    static_assert(is_boolean<F>, "in the model it is a boolean, in the message it is not");
}

template <class F>
void require_integer(const F&)
{
    static_assert(is_integer<F>, "in the model it is an integer, in the message it is not");
}

template <class F>
void require_double(const F&)
{
    static_assert(std::is_floating_point<F>::value, "in the model it is a double, in the message it is not");
}

template <class F>
void require_string(const F&)
{
    static_assert(is_text<F>, "in the model it is a string, in the message it is not");
}

/* Received. */

/* An element of an array is no bool, since it may be unknown. */
template <class F, class V>
void read_boolean(const F& field, V& value)
{
    require_boolean(field);
    value = static_cast<V>(field ? 1 : 0);
}

template <class F>
void read_integer(const F& field, std::int64_t& value)
{
    require_integer(field);
    /* The least number stands for unknown; one outside 64 bits is out of every range anyway. */
    if constexpr (std::is_unsigned<F>::value && sizeof(F) >= sizeof(std::int64_t)) {
        const auto greatest = static_cast<F>(std::numeric_limits<std::int64_t>::max());
        value = static_cast<std::int64_t>(field > greatest ? greatest : field);
    } else {
        value = static_cast<std::int64_t>(field);
        value = value == INT64_MIN ? INT64_MIN + 1 : value;
    }
}

template <class F>
void read_double(const F& field, double& value)
{
    require_double(field);
    value = static_cast<double>(field);
}

template <class F>
void read_string(const F& field, const char*& value)
{
    require_string(field);
    value = field.c_str();
}

/* Sent. `where` names the field in an error. */

template <class F>
void assign_boolean(F& field, bool value, const char*)
{
    require_boolean(field);
    field = value;
}

template <class F>
void assign_integer(F& field, std::int32_t value, const char* where)
{
    require_integer(field);
    const auto wide = static_cast<std::int64_t>(value);
    bool fits = true;
    if constexpr (sizeof(F) < sizeof(std::int64_t)) {
        fits = wide >= static_cast<std::int64_t>(std::numeric_limits<F>::min())
            && wide <= static_cast<std::int64_t>(std::numeric_limits<F>::max());
    } else if constexpr (std::is_unsigned<F>::value) {
        fits = wide >= 0;
    }
    if (!fits) {
        throw Misfit(std::string(where) + ": " + std::to_string(value) + " is outside "
            + std::to_string(std::numeric_limits<F>::min()) + ".." + std::to_string(std::numeric_limits<F>::max()));
    }
    field = static_cast<F>(value);
}

template <class F>
void assign_double(F& field, double value, const char* where)
{
    require_double(field);
    /* False for NaN and infinities, too. */
    if (!(std::fabs(value) <= static_cast<double>(std::numeric_limits<F>::max()))) {
        throw Misfit(std::string(where) + ": " + number_text(value) + " does not fit into the field");
    }
    field = static_cast<F>(value);
}

template <class F>
void assign_string(F& field, const char* value, const char*)
{
    require_string(field);
    field = value;
}

/* Stamp a header; an action's request that has none is stamped in the given fields that have one. */
template <class Time, class M>
void stamp(M& message, const char* frame, const Time& now)
{
    static_assert(detail::HasHeader<M>::value, "the model stamps this message, but it has no header");
    message.header.stamp = now;
    message.header.frame_id = frame;
}

template <class Time, class M, class... Fields>
void stamp_request(M& message, const char* frame, const Time& now, Fields&... fields)
{
    if constexpr (detail::HasHeader<M>::value) {
        stamp(message, frame, now);
    } else {
        static_assert((detail::HasHeader<Fields>::value || ...), "the model stamps this request, but it has no header");
        const auto stamp_field = [&](auto& field) {
            if constexpr (detail::HasHeader<std::decay_t<decltype(field)>>::value) {
                stamp(field, frame, now);
            }
        };
        (stamp_field(fields), ...);
    }
}

}  // namespace robosc
