// Files that a run writes line by line.
#pragma once

#include <cstdio>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace telesplat::metrics {

/// A file that closes itself. One that is not open takes everything and writes nothing. What it writes is valid UTF-8.
class TextFile {
 public:
  /// Empties the file at `path`, or makes it. Returns false, and sets errno, if that fails.
  bool open(const std::string& path);
  bool is_open() const { return file_ != nullptr; }
  void write(std::string_view text);
  void flush();

 private:
  struct Close {
    void operator()(FILE* file) const { std::fclose(file); }
  };
  std::unique_ptr<FILE, Close> file_;
};

/// A line of CSV, with its end.
std::string csv_line(const std::vector<std::string>& cells);
/// A text as CSV has it (RFC 4180). Line ends become spaces, so that a row is a line.
std::string csv_quoted(const std::string& text);

}  // namespace telesplat::metrics
