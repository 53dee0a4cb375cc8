// Unpacks gzip, zlib and deflate streams in memory.
#pragma once

#include <zlib.h>

#include <algorithm>
#include <string>
#include <string_view>

#include "services/data/base/refusal.h"

namespace telesplat::data {

class Inflater {
 public:
  /// name: the file's, for errors. deflate: the stream has no gzip or zlib header.
  Inflater(std::string_view packed, std::string name, bool deflate = false) : rest_(packed), name_(std::move(name)) {
    if (inflateInit2(&stream_, deflate ? -15 : 15 + 32) != Z_OK) refuse("{}: no memory for unpacking it", name_);
  }
  ~Inflater() { inflateEnd(&stream_); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  /// Unpacks at most `bytes`; returns their number, 0 at the end. Refuses damaged data, after the intact part.
  size_t read(void* to, size_t bytes) {
    if (damaged_) refuse("{}: its compressed data are damaged: {}", name_, stream_.msg ? stream_.msg : "zlib gave up");
    stream_.next_out = static_cast<Bytef*>(to);
    stream_.avail_out = static_cast<uInt>(bytes);
    while (bytes > 0 && stream_.avail_out == bytes && !ended_) {
      if (stream_.avail_in == 0) {
        if (rest_.empty()) break;
        stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(rest_.data()));
        stream_.avail_in = uInt(std::min<size_t>(rest_.size(), 1 << 30));
        rest_.remove_prefix(stream_.avail_in);
      }
      const int status = inflate(&stream_, Z_NO_FLUSH);
      if (status == Z_STREAM_END) {
        // Another member may follow: gzip files may be concatenated.
        ended_ = stream_.avail_in < 2 || stream_.next_in[0] != 0x1f || inflateReset(&stream_) != Z_OK;
      } else if (status != Z_OK && status != Z_BUF_ERROR) {
        damaged_ = true;
        break;
      }
    }
    if (damaged_ && stream_.avail_out == bytes) return read(to, bytes);  // refuses
    return bytes - stream_.avail_out;
  }
  /// True if the stream's own end was reached.
  bool ended() const { return ended_; }

 private:
  std::string_view rest_;
  std::string name_;
  z_stream stream_{};
  bool ended_ = false, damaged_ = false;
};

}  // namespace telesplat::data
