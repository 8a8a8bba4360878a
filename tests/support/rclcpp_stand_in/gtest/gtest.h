// A stand-in for GoogleTest: of what generated tests use, with a main function. A failure is one line.

#pragma once

#include <functional>
#include <iostream>
#include <string>
#include <utility>
#include <vector>

namespace testing {

inline int& failures()
{
    static int count = 0;
    return count;
}

inline std::vector<std::string>& traces()
{
    static std::vector<std::string> made;
    return made;
}

class Trace {
public:
    explicit Trace(std::string text) { traces().push_back(std::move(text)); }
    ~Trace() { traces().pop_back(); }
};

inline void check(bool is_good, const char* what)
{
    if (!is_good) {
        failures()++;
        std::cout << "failed" << (traces().empty() ? "" : " at " + traces().back()) << ": " << what << std::endl;
    }
}

inline std::vector<std::pair<std::string, std::function<void()>>>& tests()
{
    static std::vector<std::pair<std::string, std::function<void()>>> made;
    return made;
}

inline int add(const std::string& name, std::function<void()> test)
{
    tests().emplace_back(name, std::move(test));
    return 0;
}

}  // namespace testing

#define TEST(Suite, Name)                                                                                              \
    static void Suite##_##Name();                                                                                      \
    static const int Suite##_##Name##_added = ::testing::add(#Suite "." #Name, Suite##_##Name);                       \
    static void Suite##_##Name()
#define EXPECT_EQ(one, other) ::testing::check((one) == (other), #one " == " #other)
#define EXPECT_TRUE(value) ::testing::check((value), #value)
#define SCOPED_TRACE(text) const ::testing::Trace trace(text)

int main()
{
    for (const auto& [name, test] : testing::tests()) {
        std::cout << name << std::endl;
        test();
    }
    return testing::failures() == 0 ? 0 : 1;
}
