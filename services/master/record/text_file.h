// Files that a run writes line by line. A disk that is full takes nothing away from what is written, and ends nothing.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"

namespace telesplat::metrics {

/// A file of rows that closes itself. One that is not open takes everything and writes nothing. What it writes is valid
/// UTF-8. It holds whole rows alone: once a row cannot be written, the file ends with the row before, which is logged
/// once, and further rows are counted. What a process that is killed had not flushed is missing; whole rows are there.
class TextFile {
 public:
  TextFile() = default;
  TextFile(TextFile&& other) noexcept { *this = std::move(other); }
  TextFile& operator=(TextFile&& other) noexcept;
  ~TextFile() { close(); }

  /// Empties the file at `path`, or makes it. limit_bytes: of the file; rows beyond are left out, which is logged once,
  /// and counted; 0: none. Returns false, and sets errno, if that fails.
  bool open(const std::string& path, uint64_t limit_bytes = 0);
  /// The same, but what is there stays up to its first `keep_bytes`, and rows go on behind it.
  bool open_behind(const std::string& path, uint64_t keep_bytes, uint64_t limit_bytes = 0);
  bool is_open() const { return fd_ >= 0; }
  void write(std::string_view row);
  /// A row that the limit does not keep out: the file's end.
  void write_end(std::string_view row);
  void flush();
  /// Flushes, and says whether the file is whole on disk, as far as that is known.
  void close();

  const std::string& path() const { return path_; }
  /// Of the first row that could not be written; ok: all could.
  const Status& status() const { return status_; }
  uint64_t rows_lost() const { return rows_lost_; }  ///< that could not be written
  uint64_t rows_cut() const { return rows_cut_; }    ///< beyond the limit

 private:
  void put(std::string_view row);
  void fail(int error);

  int fd_ = -1;
  std::string path_, buffer_;
  uint64_t limit_bytes_ = 0, bytes_ = 0;  // bytes_: of whole rows in the file
  uint64_t buffered_rows_ = 0, rows_lost_ = 0, rows_cut_ = 0;
  Status status_ = ok_status();
};

/// A line of CSV, with its end.
std::string csv_line(const std::vector<std::string>& cells);
/// A text as CSV has it (RFC 4180). Line ends become spaces, so that a row is a line.
std::string csv_quoted(const std::string& text);
/// The same without quotes where nothing in it needs any.
std::string csv_cell(const std::string& text);
/// The cells of a line, without its end and their quotes.
std::vector<std::string> csv_cells(std::string_view line);

/// A whole number as a cell.
inline std::string whole_cell(uint64_t v) { return std::to_string(v); }

}  // namespace telesplat::metrics
