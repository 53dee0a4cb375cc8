#include "services/packer/points/frame_book.h"

#include <fmt/format.h>

#include <algorithm>

namespace telesplat::packer {

const FrameBook::Frame* FrameBook::find(FrameId id) const {
  const auto found = std::find_if(open_.begin(), open_.end(), [&](const Frame& f) { return f.id == id; });
  return found == open_.end() ? nullptr : &*found;
}

bool FrameBook::is_finished(FrameId id) const { return is_finished_.contains(id) || (id <= forgotten_ && !find(id)); }

bool FrameBook::has(FrameId id, uint32_t tile) const {
  if (is_finished(id)) return true;
  const Frame* frame = find(id);
  return frame && tile < frame->has_tile.size() && frame->has_tile[tile];
}

std::optional<FrameBook::Left> FrameBook::left(FrameId id, uint32_t tiles) const {
  if (is_finished(id)) return std::nullopt;
  const Frame* frame = find(id);
  if (!frame) return Left{.tiles = tiles, .tiles_in_frame = tiles};
  const auto first = std::find(frame->has_tile.begin(), frame->has_tile.end(), false);
  return Left{.tiles = frame->tiles_left,
              .first = static_cast<uint32_t>(first - frame->has_tile.begin()),
              .tiles_in_frame = static_cast<uint32_t>(frame->has_tile.size())};
}

Status FrameBook::check(const FramePart& tile) const {
  const Frame* frame = find(tile.frame);
  if (!frame) return ok_status();
  if (frame->has_tile.size() != tile.tiles_in_frame)
    return Error{fmt::format("tile {} of frame {} says its frame has {} tiles, earlier ones said {}", tile.tile,
                             tile.frame.value, tile.tiles_in_frame, frame->has_tile.size())};
  if (!(frame->camera == tile.camera))
    return Error{fmt::format("tile {} of frame {} has another camera than its frame", tile.tile, tile.frame.value)};
  return ok_status();
}

FrameBook::Frame FrameBook::add(const FramePart& tile, const splat::Elimination& elimination, bool missed) {
  if (!find(tile.frame)) {
    if (open_.size() == kMaxOpenFrames) open_.pop_front();
    open_.push_back({tile.frame, tile.camera, std::vector<bool>(tile.tiles_in_frame), tile.tiles_in_frame});
  }
  const auto at = std::find_if(open_.begin(), open_.end(), [&](const Frame& f) { return f.id == tile.frame; });
  at->has_tile[tile.tile] = true;
  --at->tiles_left;
  if (tile.left_out > 0) at->tiles_left = 0;
  at->samples += elimination.samples;
  at->kept += elimination.kept;
  at->untold += elimination.samples;

  Frame frame = *at;
  const bool completes = frame.tiles_left == 0 && !tile.extra;
  frame.nothing_new = elimination.kept == 0 && !missed && !completes;
  if (!frame.nothing_new) at->untold = 0;
  if (frame.tiles_left == 0) {
    open_.erase(at);
    finished_.push_back(frame.id);
    is_finished_.insert(frame.id);
    if (finished_.size() > kMaxFinishedFrames) {
      is_finished_.erase(finished_.front());
      forgotten_ = std::max(forgotten_, finished_.front());
      finished_.pop_front();
    }
  }
  return frame;
}

void FrameBook::clear() {
  open_.clear();
  finished_.clear();
  is_finished_.clear();
  forgotten_ = {};
}

}  // namespace telesplat::packer
