// Inside services/data/cloud: the compressed points of LAZ files, COPC among them. Source: M. Isenburg,
// "LASzip: lossless compression of LiDAR data", PE&RS 79, 2013.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "services/data/cloud/bytes.h"
#include "services/data/cloud/laz/items.h"

namespace telesplat::data {

/// The record of a LAS file that says how it is compressed.
inline constexpr const char* kLazUser = "laszip encoded";
inline constexpr uint16_t kLazRecord = 22204;

class LazPoints {
 public:
  /// Points as the header of a LAS file tells them.
  struct Header {
    int format = 0;
    size_t point_bytes = 0, points_at = 0;
    uint64_t count = 0;
  };
  /// Finds the chunks. content: the file; record: that of kLazRecord; name: for error texts. Throws Refusal: damaged;
  /// items of version 1, wave packets.
  LazPoints(std::string_view content, const std::string& name, std::string_view record, const Header& header);

  size_t chunks() const { return chunks_.size(); }
  /// Decodes the first points of a chunk, at most `most`, to LAS records behind each other. Memory grows as they are
  /// decoded. Any thread. Throws Refusal.
  std::vector<char> decode(size_t chunk, uint64_t most) const;

 private:
  struct Chunk {
    std::string_view bytes;
    uint64_t points = 0;
  };
  void read_items(std::string_view record, const Header& header);
  void find_chunks(std::string_view content, uint32_t chunk_points, const Header& header);

  const std::string& name_;
  laz::Items items_;
  std::vector<Chunk> chunks_;
};

}  // namespace telesplat::data
