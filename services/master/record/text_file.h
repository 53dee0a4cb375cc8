// Files that a run writes line by line. A full disk neither damages rows that are written nor ends the run.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"

namespace telesplat::metrics {

/// A file of rows that closes itself. One that is not open drops all rows. It writes valid UTF-8, and whole rows only:
/// once a row cannot be written, the file ends with the row before, which is logged once, and further rows are counted.
/// If the process is killed, rows that were not flushed are missing.
class TextFile {
 public:
  TextFile() = default;
  TextFile(TextFile&& other) noexcept { *this = std::move(other); }
  TextFile& operator=(TextFile&& other) noexcept;
  ~TextFile() { close(); }

  /// Empties the file at `path`, or makes it. limit_bytes: size of the file at most; rows beyond are left out,
  /// which is logged once, and counted; 0: no limit. Returns false, and sets errno, if that fails.
  bool open(const std::string& path, uint64_t limit_bytes = 0);
  /// Likewise, but the file's first `keep_bytes` bytes stay, and rows go on behind them.
  bool open_behind(const std::string& path, uint64_t keep_bytes, uint64_t limit_bytes = 0);
  bool is_open() const { return fd_ >= 0; }
  void write(std::string_view row);
  /// Writes the file's last row, which the limit does not keep out.
  void write_end(std::string_view row);
  void flush();
  /// Flushes and closes the file; status() then says if it is whole on disk, as far as that is known.
  void close();

  const std::string& path() const { return path_; }
  /// Error of the first row that could not be written; ok: all could.
  const Status& status() const { return status_; }
  uint64_t rows_lost() const { return rows_lost_; }  ///< rows that could not be written
  uint64_t rows_cut() const { return rows_cut_; }    ///< rows beyond the limit

 private:
  void put(std::string_view row);
  void fail(int error);

  int fd_ = -1;
  std::string path_, buffer_;
  uint64_t limit_bytes_ = 0, bytes_ = 0;  // bytes_: size of the whole rows in the file
  uint64_t buffered_rows_ = 0, rows_lost_ = 0, rows_cut_ = 0;
  Status status_ = ok_status();
};

/// Returns a line of CSV with its line end.
std::string csv_line(const std::vector<std::string>& cells);
/// Returns a text in quotes, as in CSV (RFC 4180). Line ends become spaces, so that a row is a line.
std::string csv_quoted(const std::string& text);
/// Likewise, but without quotes if the text needs none.
std::string csv_cell(const std::string& text);
/// Returns the cells of a line without quotes. The line comes without its end.
std::vector<std::string> csv_cells(std::string_view line);

/// A whole number as a cell.
inline std::string whole_cell(uint64_t v) { return std::to_string(v); }

}  // namespace telesplat::metrics
