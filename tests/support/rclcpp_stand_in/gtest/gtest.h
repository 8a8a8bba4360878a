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

/* A test is a member of a class that is made of this one, whose names hide those of the file. */
class Test {
private:
    void Run();
    void DeleteSelf_();

protected:
    void SetUp();
    void TearDown();
};

}  // namespace testing

#define TEST(Suite, Name)                                                                                              \
    class Suite##_##Name##_Test : public ::testing::Test {                                                             \
    public:                                                                                                            \
        void TestBody();                                                                                               \
    };                                                                                                                 \
    static const int Suite##_##Name##_added                                                                            \
        = ::testing::add(#Suite "." #Name, [] { Suite##_##Name##_Test().TestBody(); });                                \
    void Suite##_##Name##_Test::TestBody()
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
