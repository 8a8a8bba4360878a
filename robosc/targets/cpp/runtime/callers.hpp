/* The caller's side of a supervision layer, whatever the middleware. */

#pragma once

#include <string>
#include <type_traits>
#include <utility>

#include "json.hpp"

namespace robosc {

/* The text of the topic blocked. */
inline std::string blocked_text(const std::string& identifier, const std::string& why)
{
    std::string text = "{\"identifier\": ";
    put_json(text, identifier);
    text += ", \"reason\": ";
    put_json(text, why);
    return text + "}";
}

namespace detail {

template <class M, class Get>
auto put_text(M& message, const std::string& text, const Get& get, int)
    -> std::enable_if_t<std::is_assignable<decltype(get(message)), std::string>::value, bool>
{
    get(message) = text;
    return true;
}

template <class M, class Get>
bool put_text(M&, const std::string&, const Get&, long)
{
    return false;
}

}  // namespace detail

/* Put a reason into the field of a default response or result that is meant for people, if there is one. */
template <class M>
void give_reason(M& message, const std::string& why)
{
    const auto is_put = [&](const auto& get) { return detail::put_text(message, why, get, 0); };
    static_cast<void>(is_put([](auto& m) -> decltype((m.message)) { return m.message; })
        || is_put([](auto& m) -> decltype((m.error_msg)) { return m.error_msg; })
        || is_put([](auto& m) -> decltype((m.error_string)) { return m.error_string; })
        || is_put([](auto& m) -> decltype((m.error_message)) { return m.error_message; })
        || is_put([](auto& m) -> decltype((m.status_message)) { return m.status_message; })
        || is_put([](auto& m) -> decltype((m.reason)) { return m.reason; }));
}

/* True if every field of a message has its default; its header does not count. */
template <class M>
auto is_plain(const M& message, int) -> std::enable_if_t<sizeof(message.header.frame_id) != 0, bool>
{
    M plain;
    plain.header = message.header;
    return message == plain;
}

template <class M>
bool is_plain(const M& message, long)
{
    return message == M();
}

}  // namespace robosc
