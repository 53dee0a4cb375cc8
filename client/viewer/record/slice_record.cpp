#include "client/viewer/record/slice_record.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>

#include "common/wire/serial.h"

namespace telesplat::viewer {
namespace {

constexpr std::string_view kSliceMagic = "TSSLICE1", kGrid = "grid";

struct GridBody {
  uint32_t size[3];
  uint32_t unused;
  double index_to_room[16];
};
static_assert(sizeof(GridBody) == 144);

}  // namespace

bool SliceRecorder::ready() {
  if (file_ || error_) return file_.has_value();
  auto file = RecordWriter::open(path_, kSliceMagic, max_bytes_, "slice images");
  error_ = file ? 0 : errno;
  if (file)
    file_ = std::move(*file);
  else
    log::error("{}; slice images are not recorded", file.error().text);
  return file_.has_value();
}

void SliceRecorder::add(const volume::Grid& grid, const wire::SliceFrame& frame) {
  if (!ready() || file_->full()) return;
  if (grid_ != grid) {
    GridBody body{};
    for (size_t i = 0; i < 3; ++i) body.size[i] = static_cast<uint32_t>(grid.size[i]);
    for (int column = 0; column < 4; ++column)
      for (int row = 0; row < 4; ++row) body.index_to_room[4 * column + row] = grid.index_to_room[column][row];
    file_->write(kGrid, {reinterpret_cast<const char*>(&body), sizeof body});
    grid_ = grid;
  }
  file_->write(wire::SliceFrame::kName, wire::encode(frame));
}

void SliceRecorder::flush() {
  if (file_) file_->flush();
}

Result<std::unique_ptr<SliceReplay>> SliceReplay::open(const std::string& path) {
  auto file = RecordReader::open(path, {kSliceMagic}, "a record of slice images");
  if (!file) return file.error();
  return std::unique_ptr<SliceReplay>(new SliceReplay(std::move(*file)));
}

Status SliceReplay::read_grid() {
  GridBody body;
  if (file_.body().size() != sizeof body)
    return file_.wrong(fmt::format("{} bytes instead of {}", file_.body().size(), sizeof body));
  std::memcpy(&body, file_.body().data(), sizeof body);
  volume::Grid grid;
  for (size_t i = 0; i < 3; ++i) grid.size[i] = static_cast<int>(std::min<uint32_t>(body.size[i], 1u << 30));
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 4; ++row) grid.index_to_room[column][row] = body.index_to_room[4 * column + row];
  if (const Status s = volume::validate(grid); !s) return file_.wrong(s.error().text);
  grid_ = grid;
  return ok_status();
}

Result<bool> SliceReplay::read_frame(FrameId wanted, uint32_t replica) {
  const std::string& body = file_.body();
  const auto frame = wire::decode<wire::SliceFrame>({reinterpret_cast<const std::byte*>(body.data()), body.size()});
  if (!frame) return file_.wrong(frame.error().text);
  if (!grid_) return file_.wrong("comes before any grid");
  if (frame->frame <= newest_) ++replica_;
  newest_ = frame->frame;
  if (frame->frame != wanted || replica_ < replica) return false;
  auto decoded = decode_frame(*frame, *grid_, images_);
  if (!decoded) return file_.wrong(fmt::format("frame {}: {}", wanted.value, decoded.error().text));
  shown_ = std::move(decoded->frame);
  return true;
}

Result<bool> SliceReplay::advance(FrameId frame, uint32_t replica) {
  if (shown_ && shown_->frame == frame && replica_ >= replica) return true;
  while (file_.next()) {
    if (file_.type() == kGrid) {
      if (const Status s = read_grid(); !s) return s.error();
    } else if (file_.type() == wire::SliceFrame::kName) {
      const auto found = read_frame(frame, replica);
      if (!found || *found) return found;
    } else {
      return file_.wrong("is no frame of slice images");
    }
  }
  return false;
}

}  // namespace telesplat::viewer
