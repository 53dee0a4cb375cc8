#include "common/core/utf8.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "common/core/log.h"

namespace telesplat {
namespace {

std::string encoded(uint32_t code) {
  std::string out;
  const auto add = [&](uint32_t byte) { out += static_cast<char>(byte); };
  if (code < 0x80) {
    add(code);
  } else if (code < 0x800) {
    add(0xc0 | code >> 6), add(0x80 | (code & 63));
  } else if (code < 0x10000) {
    add(0xe0 | code >> 12), add(0x80 | (code >> 6 & 63)), add(0x80 | (code & 63));
  } else {
    add(0xf0 | code >> 18), add(0x80 | (code >> 12 & 63)), add(0x80 | (code >> 6 & 63)), add(0x80 | (code & 63));
  }
  return out;
}

bool is_surrogate(uint32_t code) { return code >= 0xd800 && code < 0xe000; }

TEST(Utf8, TakesEveryCharacterAndNoSurrogate) {
  for (uint32_t code = 0; code < 0x110000; ++code) {
    const std::string text = encoded(code);
    ASSERT_EQ(valid_utf8(text), !is_surrogate(code)) << std::hex << code;
    if (!is_surrogate(code)) {
      ASSERT_EQ(to_utf8(text), text) << std::hex << code;
    }
  }
}

TEST(Utf8, RefusesWhatIsBeyondUnicode) {
  for (uint32_t code = 0x110000; code < 0x200000; code += 97)
    ASSERT_FALSE(valid_utf8(encoded(code))) << std::hex << code;
  EXPECT_FALSE(valid_utf8("\xf8\x88\x80\x80\x80"));
  EXPECT_FALSE(valid_utf8("\xff"));
}

TEST(Utf8, RefusesOverlongForms) {
  for (const char* text :
       {"\xc0\xaf", "\xc1\xbf", "\xe0\x80\xaf", "\xe0\x9f\xbf", "\xf0\x80\x80\xaf", "\xf0\x8f\xbf\xbf"})
    EXPECT_FALSE(valid_utf8(text)) << to_utf8(text);
}

TEST(Utf8, RefusesCharactersThatAreCutOff) {
  for (const uint32_t code : {0xe9u, 0x20acu, 0x1f600u}) {
    const std::string whole = encoded(code);
    for (size_t bytes = 1; bytes < whole.size(); ++bytes) {
      EXPECT_FALSE(valid_utf8(whole.substr(0, bytes)));
      EXPECT_EQ(to_utf8(whole.substr(0, bytes)), "\xef\xbf\xbd");
      EXPECT_EQ(to_utf8(whole.substr(0, bytes) + "a"),
                "\xef\xbf\xbd"
                "a");
    }
  }
}

TEST(Utf8, ReplacesTheBytesOfAnotherEncoding) {
  EXPECT_EQ(to_utf8("caf\xe9.ply"), "caf\xef\xbf\xbd.ply");
  EXPECT_EQ(to_utf8("\x80\xbf"), "\xef\xbf\xbd\xef\xbf\xbd");
  EXPECT_EQ(to_utf8("\xed\xa0\x80"), "\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd");
}

TEST(Utf8, EveryPairOfBytesBecomesValid) {
  for (int a = 0; a < 256; ++a)
    for (int b = 0; b < 256; ++b) {
      const std::string text{static_cast<char>(a), static_cast<char>(b)};
      const std::string made = to_utf8(text);
      ASSERT_TRUE(valid_utf8(made)) << a << " " << b;
      ASSERT_EQ(made == text, valid_utf8(text)) << a << " " << b;
    }
}

TEST(Utf8, KeepsZeroBytesAndEmptyText) {
  EXPECT_TRUE(valid_utf8(""));
  EXPECT_EQ(to_utf8(std::string_view("a\0b", 3)), std::string("a\0b", 3));
}

TEST(Printable, HasNothingThatSteersATerminal) {
  EXPECT_EQ(printable("J\xc3\xbcrgen, \"x\" \xe2\x82\xac \xf0\x9f\x98\x80"),
            "J\xc3\xbcrgen, \"x\" \xe2\x82\xac \xf0\x9f\x98\x80");
  const std::string gone = "\xef\xbf\xbd";
  EXPECT_EQ(printable("\x1b[2J"), gone + "[2J");
  EXPECT_EQ(printable("a\r\nb\x7f"), "a" + gone + gone + "b" + gone);
  EXPECT_EQ(printable("\xc2\x9b"
                      "31m"),
            gone + "31m")
      << "C1";
  EXPECT_EQ(printable("\xc2\xa0"), "\xc2\xa0");
  EXPECT_EQ(printable("\xe2\x80\xae"
                      "txt\xe2\x81\xa6\xe2\x80\xa8"),
            gone + "txt" + gone + gone)
      << "turned round";
  EXPECT_EQ(printable("\xff"), gone);
  EXPECT_EQ(printable(std::string(300, 'x')), std::string(253, 'x') + "...");
  EXPECT_TRUE(valid_utf8(printable("xxxxxx\xc3\xa9xxxxxx", 10)));
}

TEST(Printable, LinesKeepTheirFeedsAndNothingThatSteersATerminal) {
  EXPECT_EQ(printable_lines("one\ntwo\n"), "one\ntwo\n");
  EXPECT_EQ(printable_lines(""), "");
  EXPECT_EQ(printable_lines("\x1b[2J\r\n\tx"), "\xef\xbf\xbd[2J\xef\xbf\xbd\n\xef\xbf\xbdx");
  const std::string longer(5000, 'a');
  EXPECT_EQ(printable_lines(longer + "\n" + longer), longer + "\n" + longer);
}

// Many lines of logs contain texts from peers.
TEST(Log, ALineIsOneLineWhateverIsInIt) {
  testing::internal::CaptureStderr();
  log::initialise("printable", "info");
  log::warn("it said: {}", "\x1b[2J\n12:00:00 master error forged \xff" + std::string(10000, 'a'));
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1);
  EXPECT_EQ(said.find('\x1b'), std::string::npos);
  EXPECT_TRUE(valid_utf8(said));
  EXPECT_NE(said.find("forged"), std::string::npos);
  EXPECT_LT(said.size(), 4200u);
}

}  // namespace
}  // namespace telesplat
