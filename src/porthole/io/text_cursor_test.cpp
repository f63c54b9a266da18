#include "porthole/io/text_cursor.h"

#include <gtest/gtest.h>

namespace porthole {
namespace {

TEST(TextCursor, AllLineEndsCountOnce) {
    TextCursor c("a\nb\r\nc\rd\n\n\re");
    std::string words;
    for (; !c.at_end(); c.next_line()) words += std::string(c.word()) + std::to_string(c.line()) + " ";
    EXPECT_EQ(words, "a1 b2 c3 d4 5 6 e7 ");
}

TEST(TextCursor, NumbersFillTheirWord) {
    const auto reads = [](std::string_view text) {
        float value = -77;
        TextCursor c(text);
        return c.number(value) ? value : -77;
    };
    EXPECT_EQ(reads("1"), 1);
    EXPECT_EQ(reads("  +2."), 2);
    EXPECT_EQ(reads("-.5e-1"), -0.05f);
    EXPECT_EQ(reads("1E2 rest"), 100);
    EXPECT_EQ(reads("1e400"), kInfinity);
    EXPECT_EQ(reads("1e-400"), 0);
    EXPECT_EQ(reads("16777217"), 16777216);
    for (const char* bad : {"", " ", "x", "+", "-", "+-1", "--1", "1,5", "1.0.0", "3.1+e2", "0x10", "1e", "\n1"})
        EXPECT_EQ(reads(bad), -77) << bad;
}

TEST(TextCursor, IntegersSaturate) {
    const auto reads = [](std::string_view text) {
        std::int64_t value = 0;
        TextCursor c(text);
        EXPECT_TRUE(c.integer(value));
        return value;
    };
    EXPECT_EQ(reads("12/3"), 12);
    EXPECT_EQ(reads("+12"), 12);
    EXPECT_EQ(reads("-12"), -12);
    EXPECT_EQ(reads("99999999999999999999"), std::numeric_limits<std::int64_t>::max());
    EXPECT_EQ(reads("-99999999999999999999"), std::numeric_limits<std::int64_t>::min());
    std::int64_t value = 0;
    EXPECT_FALSE(TextCursor("/1").integer(value));
    EXPECT_FALSE(TextCursor("+-1").integer(value));
}

TEST(TextCursor, ContinuationsOnlyWhereAsked) {
    TextCursor joined("f 1 \\\n2\\\r\n 3\nnext", true);
    EXPECT_EQ(joined.word(), "f");
    float value = 0;
    for (const float expected : {1.f, 2.f, 3.f}) {
        ASSERT_TRUE(joined.number(value));
        EXPECT_EQ(value, expected);
    }
    EXPECT_TRUE(joined.at_line_end());
    EXPECT_EQ(joined.line(), 3u);
    joined.next_line();
    EXPECT_EQ(joined.word(), "next");

    TextCursor plain("a \\\nb");
    EXPECT_EQ(plain.word(), "a");
    EXPECT_EQ(plain.word(), "\\");
    TextCursor at_the_end("a \\", true);
    EXPECT_EQ(at_the_end.word(), "a");
    EXPECT_TRUE(at_the_end.at_line_end());
    TextCursor windows_path("map_Kd dir\\file.png\n", true);
    EXPECT_EQ(windows_path.word(), "map_Kd");
    EXPECT_EQ(windows_path.rest_of_line(), "dir\\file.png");
}

} // namespace
} // namespace porthole
