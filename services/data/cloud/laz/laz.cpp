#include "services/data/cloud/laz/laz.h"

#include <fmt/format.h>

#include <algorithm>

#include "services/data/base/refusal.h"

namespace telesplat::data {
namespace {

constexpr size_t kRecordBytes = 34;  // without items
constexpr uint32_t kVariable = ~uint32_t{0};

}  // namespace

LazPoints::LazPoints(std::string_view content, const std::string& name, std::string_view record, const Header& header)
    : name_(name) {
  if (record.size() < kRecordBytes)
    refuse("{}: is damaged: its record of LASzip has {} bytes, {} are needed", name_, record.size(), kRecordBytes);
  read_items(record, header);
  find_chunks(content, number<uint32_t>(record, 12), header);
}

void LazPoints::read_items(std::string_view record, const Header& header) {
  enum { kBytes = 0, kPoint10 = 6, kTime, kRgb, kWaves13, kPoint14, kRgb14, kRgbInfrared14, kWaves14, kBytes14 };
  const auto compressor = number<uint16_t>(record, 0), coder = number<uint16_t>(record, 2);
  items_.layered = compressor == 3;
  if (compressor < 2 || compressor > 3 || coder != 0)
    refuse("{}: is LAZ of compressor {}, coder {}; compressors 2 and 3 with coder 0 are read", name_, compressor,
           coder);
  for (size_t i = 0; i < number<uint16_t>(record, 32); ++i) {
    const size_t at = kRecordBytes + 6 * i;
    if (at + 6 > record.size()) refuse("{}: is damaged: its record of LASzip lacks item {}", name_, i);
    const auto type = number<uint16_t>(record, at), bytes = number<uint16_t>(record, at + 2),
               version = number<uint16_t>(record, at + 4);
    if (type == kWaves13 || type == kWaves14) refuse("{}: is LAZ with wave packets, which are not read", name_);
    if (items_.layered ? version != 3 && version != 4 : version != 2)
      refuse("{}: is LAZ with item {} of version {}; {} read", name_, type, version,
             items_.layered ? "3 and 4 are" : "version 2 is");
    if (type == kTime) items_.time = true;
    if (type == kRgb || type == kRgb14 || type == kRgbInfrared14) items_.colours = true;
    if (type == kRgbInfrared14) items_.infrared = true;
    if (type == kBytes || type == kBytes14) items_.extra = bytes;
    items_.each_has_its_channel = version == 4;
  }
  const int f = header.format;
  const bool fits = items_.layered == (f >= 6) && items_.time == (f == 1 || f == 3) &&
                    items_.colours == (f == 2 || f == 3 || f == 7 || f == 8) && items_.infrared == (f == 8);
  if (!fits || items_.bytes() != header.point_bytes)
    refuse("{}: is damaged: its record of LASzip does not tell of points of format {} with {} bytes", name_, f,
           header.point_bytes);
}

void LazPoints::find_chunks(std::string_view content, uint32_t chunk_points, const Header& header) {
  if (header.count == 0) return;
  const size_t begin = header.points_at + 8;
  if (content.size() < begin) refuse("{}: is truncated: it ends before its first chunk", name_);
  auto table = number<uint64_t>(content, header.points_at);
  if (table == ~uint64_t{0}) table = number<uint64_t>(content, content.size() - 8);  // by writers that cannot go back
  if (table < begin || table > content.size() || content.size() - table < 8)
    refuse("{}: is truncated: its table of chunks lies at byte {} of {}", name_, table, content.size());
  const auto count = number<uint32_t>(content, table + 4);
  const uint64_t most = (table - begin) / header.point_bytes;
  const uint64_t needed = chunk_points == kVariable || chunk_points == 0
                              ? count
                              : header.count / chunk_points + (header.count % chunk_points > 0);
  if (count > most || needed > count)
    refuse("{}: is damaged: it has {} chunks, {} are needed for {} points and {} fit", name_, count, needed,
           header.count, most);
  uint64_t left = header.count, at = begin;
  try {
    laz::Decoder decoder(content.substr(table + 8));
    laz::Numbers numbers(32, 2);
    uint32_t points = 0, bytes = 0;
    for (uint64_t i = 0; i < needed; ++i) {
      if (chunk_points == kVariable) points = numbers.next(decoder, points, 0);
      bytes = numbers.next(decoder, bytes, 1);
      const uint64_t in_chunk = chunk_points == kVariable ? points : std::min<uint64_t>(left, chunk_points);
      if (bytes > table - at || in_chunk > left) throw laz::Damaged();
      if (in_chunk > 0) chunks_.push_back({content.substr(at, bytes), in_chunk});
      at += bytes, left -= in_chunk;
    }
  } catch (const laz::Damaged&) {
    refuse("{}: is damaged: chunk {} of {} in its table does not fit", name_, chunks_.size(), needed);
  }
  if (left > 0) refuse("{}: is damaged: its {} chunks lack {} of {} points", name_, needed, left, header.count);
}

std::vector<char> LazPoints::decode(size_t chunk, uint64_t most) const {
  const Chunk& from = chunks_[chunk];
  const uint64_t count = std::min(from.points, most);
  const size_t point_bytes = items_.bytes();
  std::vector<char> out;
  uint64_t made = 0;
  try {
    const auto decoder =
        items_.layered ? laz::decode_layers(items_, from.bytes, from.points) : laz::decode_together(items_, from.bytes);
    for (uint64_t room = 0; made < count; ++made) {
      if (made == room) {
        room = std::min(count, std::max(2 * room, from.bytes.size() / uint64_t{4}));
        out.resize(room * point_bytes);
      }
      decoder->next(out.data() + made * point_bytes);
    }
  } catch (const laz::Damaged&) {
    refuse("{}: is truncated or damaged: {} of the {} points of chunk {} can be decoded", name_, made, from.points,
           chunk);
  }
  return out;
}

}  // namespace telesplat::data
