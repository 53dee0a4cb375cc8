// Files of received data as they came: records, one after the other; the last one may be cut off.
//
// File: 8 letters that name its kind and version, then records  u32 type length, u64 body length, type, body
// (little-endian).
#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"

namespace telesplat::viewer {

struct CloseFile {
  void operator()(FILE* f) const { std::fclose(f); }
};
using RecordFile = std::unique_ptr<FILE, CloseFile>;

class RecordWriter {
 public:
  /// Makes the file anew. magic: 8 letters. Writes at most max_bytes, then logs a warning and omits the rest. what:
  /// kind of records, for that warning: "point-model events".
  static Result<RecordWriter> open(const std::string& path, std::string_view magic, uint64_t max_bytes,
                                   const char* what);
  void write(std::string_view type, std::string_view body);
  /// True if no more is written: the limit was reached, or the disk is full.
  bool full() const { return full_; }
  /// True if a record could not be written, which was logged once; the file ends before it.
  bool failed() const { return error_ != 0; }
  int error() const { return error_; }  ///< errno of that; 0: all was written
  /// Returns when all records so far are on disk, unless writing failed.
  void flush();

 private:
  RecordFile file_;
  std::string path_;
  const char* what_ = "";
  uint64_t bytes_ = 0, max_bytes_ = 0;
  bool full_ = false;
  int error_ = 0;

  void fail(int error);
};

class RecordReader {
 public:
  /// magics: possible beginnings of the file. what: kind of file, for errors: "a record of point-model events". Error:
  /// there is no such file, or it begins otherwise.
  static Result<RecordReader> open(const std::string& path, const std::vector<std::string_view>& magics,
                                   const char* what);

  /// Reads the next record. False at the end, also if the last one is cut off. Never allocates more than the file
  /// holds.
  bool next();
  const std::string& type() const { return type_; }
  const std::string& body() const { return body_; }
  const std::string& path() const { return path_; }
  /// "PATH: TYPE: what"
  Error wrong(const std::string& what) const;

 private:
  RecordFile file_;
  std::string path_, type_, body_;
  uint64_t left_ = 0;  // bytes of the file not read yet
};

}  // namespace telesplat::viewer
