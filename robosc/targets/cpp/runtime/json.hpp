/* Text as JSON, and numbers as Python writes them: the event log and /state look like those of the Python nodes. */

#pragma once

#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>
#include <type_traits>

namespace robosc {

/* The shortest text that is this number, in Python's form: 1.0, 1e-05, inf. */
inline std::string number_text(double value)
{
    if (std::isnan(value)) {
        return "nan";
    }
    if (std::isinf(value)) {
        return value < 0 ? "-inf" : "inf";
    }
    char buffer[64];
    const auto made = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::scientific);
    const std::string_view text(buffer, static_cast<std::size_t>(made.ptr - buffer));
    const std::size_t mark = text.find('e');
    const int exponent = std::stoi(std::string(text.substr(mark + 1)));
    const bool is_negative = text.front() == '-';
    std::string digits;
    for (const char one : text.substr(is_negative ? 1 : 0, mark - (is_negative ? 1 : 0))) {
        if (one != '.') {
            digits += one;
        }
    }
    std::string result = is_negative ? "-" : "";
    const int count = static_cast<int>(digits.size());
    if (exponent < -4 || exponent >= 16) {
        result += digits.substr(0, 1);
        if (count > 1) {
            result += "." + digits.substr(1);
        }
        char tail[16];
        std::snprintf(tail, sizeof tail, "e%c%02d", exponent < 0 ? '-' : '+', exponent < 0 ? -exponent : exponent);
        return result + tail;
    }
    if (exponent < 0) {
        return result + "0." + std::string(static_cast<std::size_t>(-exponent - 1), '0') + digits;
    }
    if (count <= exponent + 1) {
        return result + digits + std::string(static_cast<std::size_t>(exponent + 1 - count), '0') + ".0";
    }
    const auto whole = static_cast<std::size_t>(exponent) + 1;
    return result + digits.substr(0, whole) + "." + digits.substr(whole);
}

namespace detail {

inline void put_unit(std::string& out, unsigned unit)
{
    char buffer[8];
    std::snprintf(buffer, sizeof buffer, "\\u%04x", unit);
    out += buffer;
}

/* The code point at a place of UTF-8 text, and its length; U+FFFD and 1 for what is none. */
inline unsigned code_point(std::string_view text, std::size_t place, std::size_t& length)
{
    const auto byte = [&](std::size_t offset) -> unsigned {
        return place + offset < text.size() ? static_cast<unsigned char>(text[place + offset]) : 0U;
    };
    const unsigned first = byte(0);
    const unsigned more = first >= 0xF0U && first < 0xF5U ? 3 : first >= 0xE0U && first < 0xF0U ? 2
        : first >= 0xC2U && first < 0xE0U                 ? 1
                                                          : 0;
    unsigned value = more == 3 ? first & 0x07U : more == 2 ? first & 0x0FU : first & 0x1FU;
    length = 1;
    for (unsigned k = 1; k <= more; k++) {
        if ((byte(k) & 0xC0U) != 0x80U) {
            return 0xFFFDU;
        }
        value = value << 6U | (byte(k) & 0x3FU);
    }
    const bool is_overlong = (more == 2 && value < 0x800U) || (more == 3 && value < 0x10000U);
    if (more == 0 || is_overlong || value > 0x10FFFFU || (value >= 0xD800U && value < 0xE000U)) {
        return 0xFFFDU;
    }
    length = more + 1;
    return value;
}

}  // namespace detail

/* A text as a JSON string of plain ASCII. */
inline void put_json(std::string& out, std::string_view text)
{
    out += '"';
    for (std::size_t place = 0; place < text.size();) {
        const auto byte = static_cast<unsigned char>(text[place]);
        std::size_t length = 1;
        if (byte == '"' || byte == '\\') {
            out += '\\';
            out += static_cast<char>(byte);
        } else if (byte >= 0x20U && byte < 0x7FU) {
            out += static_cast<char>(byte);
        } else if (byte < 0x80U) {
            detail::put_unit(out, byte);
        } else {
            const unsigned point = detail::code_point(text, place, length);
            if (point >= 0x10000U) {
                detail::put_unit(out, 0xD800U + ((point - 0x10000U) >> 10U));
                detail::put_unit(out, 0xDC00U + ((point - 0x10000U) & 0x3FFU));
            } else {
                detail::put_unit(out, point);
            }
        }
        place += length;
    }
    out += '"';
}

inline void put_json(std::string& out, const char* text)
{
    if (text == nullptr) {
        out += "null";
    } else {
        put_json(out, std::string_view(text));
    }
}

/* A number; what JSON has no number for stands as text. */
inline void put_json(std::string& out, double value)
{
    if (std::isfinite(value)) {
        out += number_text(value);
    } else {
        put_json(out, std::string_view(number_text(value)));
    }
}

inline void put_json(std::string& out, bool value) { out += value ? "true" : "false"; }

inline void put_json(std::string& out, std::int32_t value) { out += std::to_string(value); }

/* A received integer. */
inline void put_json(std::string& out, std::int64_t value)
{
    out += value == INT64_MIN ? "null" : std::to_string(value);
}

/* A received boolean in an array. */
inline void put_json(std::string& out, std::int8_t value) { out += value < 0 ? "null" : value > 0 ? "true" : "false"; }

}  // namespace robosc
