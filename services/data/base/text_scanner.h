// Walks over the words and numbers of a text file in memory. Never reads past its end, never throws.
#pragma once

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>

namespace telesplat::data {

class TextScanner {
 public:
  explicit TextScanner(std::string_view text) : at_(text.data()), end_(text.data() + text.size()), begin_(at_) {}

  bool at_end() const { return at_ == end_; }
  size_t offset() const { return static_cast<size_t>(at_ - begin_); }
  size_t line_number() const {  // counted on demand, for error texts
    size_t lines = 1;
    for (const char* p = begin_; p < at_; ++p) lines += *p == '\n';
    return lines;
  }

  /// Skips blanks within the line. Returns true if something other than a line's end (or a comment's start) follows.
  bool skip_blanks(char comment = '\0') {
    while (at_ < end_ && (*at_ == ' ' || *at_ == '\t' || *at_ == '\r')) ++at_;
    return at_ < end_ && *at_ != '\n' && (comment == '\0' || *at_ != comment);
  }
  /// Skips white space across lines, and comments up to their line's end. Returns true if text follows.
  bool skip_space(char comment = '\0') {
    while (at_ < end_) {
      if (static_cast<unsigned char>(*at_) <= ' ')
        ++at_;
      else if (comment != '\0' && *at_ == comment)
        next_line();
      else
        return true;
    }
    return false;
  }
  void next_line() {
    while (at_ < end_ && *at_ != '\n') ++at_;
    if (at_ < end_) ++at_;
  }
  /// The characters up to the next white space; empty at a line's end. Call skip_blanks or skip_space before.
  std::string_view word() {
    const char* start = at_;
    while (at_<end_&& static_cast<unsigned char>(*at_)> ' ') ++at_;
    return {start, static_cast<size_t>(at_ - start)};
  }
  /// Reads a number: decimal, exponent, nan, inf, 1.#QNAN and the like, with or without a leading plus. The character
  /// after it must not belong to a word.
  bool number(double& out) { return parse(out); }
  bool integer(int64_t& out) { return parse(out); }
  bool value(double& out) { return parse(out); }
  bool value(int64_t& out) { return parse(out); }
  /// Skips `bytes` bytes, which need not be text, at most to the end.
  void skip(uint64_t bytes) { at_ += std::min(bytes, static_cast<uint64_t>(end_ - at_)); }
  bool skip_char(char c) { return at_ < end_ && *at_ == c ? (++at_, true) : false; }

 private:
  template <class T>
  bool parse(T& out) {
    const char* start = at_ < end_ && *at_ == '+' ? at_ + 1 : at_;
    const auto [next, error] = std::from_chars(start, end_, out);
    if (error == std::errc::result_out_of_range && std::is_floating_point_v<T>)  // 1e-999 is zero, 1e999 infinite
      out = std::string_view(start, next).find("e-") == std::string_view::npos &&
                    std::string_view(start, next).find("E-") == std::string_view::npos
                ? std::numeric_limits<T>::infinity()
                : T(0);
    else if (error != std::errc())
      return false;
    at_ = next;
    // "1.#QNAN", "-1.#IND", "1.#INF" of C libraries on Windows.
    if (std::is_floating_point_v<T> && at_ < end_ && *at_ == '#' && at_[-1] == '.') {
      out = std::numeric_limits<T>::quiet_NaN();
      word();
    }
    return true;
  }

  const char* at_;
  const char* end_;
  const char* begin_;
};

/// Returns the text without white space around it.
inline std::string_view trim(std::string_view text) {
  while (!text.empty() && static_cast<unsigned char>(text.front()) <= ' ') text.remove_prefix(1);
  while (!text.empty() && static_cast<unsigned char>(text.back()) <= ' ') text.remove_suffix(1);
  return text;
}

/// Returns the rest of a line without white space around it.
inline std::string rest_of_line(std::string_view content, size_t offset) {
  return std::string(trim(content.substr(offset, content.find('\n', offset) - offset)));
}

/// Returns the text with ASCII letters in lower case.
inline std::string lower(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return out;
}

}  // namespace telesplat::data
