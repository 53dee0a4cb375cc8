#include "services/packer/points/block_gatherer.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/codec/depth_codec.h"

namespace telesplat::packer {
namespace {

uint64_t covered(const image::DepthImage& image, size_t first, size_t count) {
  const auto begin = image.depth.begin() + static_cast<ptrdiff_t>(first);
  return count - static_cast<uint64_t>(std::count(begin, begin + static_cast<ptrdiff_t>(count), 0u));
}

std::string name_of(const FramePart& block) { return name_of(block, "block"); }

Status check(const FramePart& block, const geometry::Rect& rect) {
  if (const Status part = check(block, "block"); !part) return part;
  const geometry::Rect& b = block.rect;
  if (rect == b) return ok_status();
  if (!geometry::contains(b, rect) || rect.width != b.width)
    return Error{
        fmt::format("a tile of {} is not of whole rows of {}: {}", describe(rect), name_of(block), describe(b))};
  const size_t pixels = static_cast<size_t>(b.width) * b.height;
  if (pixels > kMaxBlockPixels)
    return Error{fmt::format("{} has {} pixels, at most {} are gathered", name_of(block), pixels, kMaxBlockPixels)};
  return ok_status();
}

// Checks that a block agrees with an earlier tile of its frame.
Status check_frame(const FramePart& block, const FramePart& earlier) {
  if (block.tiles_in_frame != earlier.tiles_in_frame)
    return Error{fmt::format("{} says its frame has {} blocks, earlier ones said {}", name_of(block),
                             block.tiles_in_frame, earlier.tiles_in_frame)};
  if (!(block.camera == earlier.camera) || block.step != earlier.step)
    return Error{fmt::format("{} has another camera than its frame", name_of(block))};
  if (block.tile == earlier.tile && !(block.rect == earlier.rect))
    return Error{fmt::format("{} is {} for one tile and {} for another", name_of(block), describe(block.rect),
                             describe(earlier.rect))};
  return ok_status();
}

}  // namespace

BlockGatherer::Frame* BlockGatherer::find(FrameId id) {
  const auto found = std::find_if(frames_.begin(), frames_.end(), [&](const Frame& f) { return f.id == id; });
  return found == frames_.end() ? nullptr : &*found;
}

// Drops the oldest frames, except `frame`, until a block of `pixels` pixels fits in.
void BlockGatherer::make_room(FrameId frame, size_t pixels) {
  const bool is_new = find(frame) == nullptr;
  for (auto oldest = frames_.begin(); oldest != frames_.end();) {
    if (pixels_ + pixels <= kMaxGatheredPixels && frames_.size() + is_new <= kMaxGatheredFrames) return;
    if (oldest->id == frame) {
      ++oldest;
      continue;
    }
    for (const Block& block : oldest->blocks) pixels_ -= block.gathered.image.pixels();
    statistics_.blocks_dropped += oldest->blocks.size();
    oldest = frames_.erase(oldest);
  }
}

Result<std::optional<BlockGatherer::Gathered>> BlockGatherer::pass(SampledTile block, std::span<const uint8_t> stream) {
  auto image = codec::decode(stream, block.rect.width, block.rect.height);
  if (!image) {
    ++statistics_.tiles_refused;
    return image.error();
  }
  ++statistics_.tiles;
  block.image = std::move(*image);
  const uint64_t samples = covered(block.image, 0, block.image.pixels());
  return std::optional<Gathered>({samples, std::move(block), true});
}

Result<std::optional<BlockGatherer::Gathered>> BlockGatherer::add(SampledTile block, const geometry::Rect& rect,
                                                                  std::span<const uint8_t> stream) {
  Status good = check(block, rect);
  const bool is_coarse = block.coarse;
  Frame* frame = find(block.frame);
  Block* open = nullptr;
  if (frame && good) {
    for (Block& b : frame->blocks)
      if (b.gathered.tile == block.tile) open = &b;
    good = check_frame(block, open ? open->gathered : frame->blocks.front().gathered);
  }
  if (!good) {
    ++statistics_.tiles_refused;
    return good.error();
  }
  if (!open && rect == block.rect) return pass(std::move(block), stream);

  if (open) {
    const auto row = open->has_row.begin() + (rect.y - block.rect.y);
    if (std::find(row, row + rect.height, false) == row + rect.height) {
      ++statistics_.tiles_duplicate;
      return std::optional<Gathered>();
    }
  }
  // The stream must hold the tile before a block is allocated for it.
  if (const Status decoded = codec::decode_into(tile_, stream, rect.width, rect.height); !decoded) {
    ++statistics_.tiles_refused;
    return decoded.error();
  }
  if (!open) {
    const size_t pixels = static_cast<size_t>(block.rect.width) * block.rect.height;
    make_room(block.frame, pixels);
    frame = find(block.frame);
    if (pixels_ + pixels > kMaxGatheredPixels) {
      ++statistics_.tiles_refused;
      return Error{fmt::format("{} has {} pixels more than {} its frame has incomplete, at most {} are gathered",
                               name_of(block), pixels, pixels_, kMaxGatheredPixels)};
    }
    if (!frame) frame = &frames_.emplace_back(Frame{block.frame, {}});
    block.image = image::DepthImage(block.rect.width, block.rect.height);
    pixels_ += pixels;
    const int rows = block.rect.height;
    open = &frame->blocks.emplace_back(Block{std::move(block), std::vector<bool>(static_cast<size_t>(rows)), rows});
  }
  open->gathered.coarse |= is_coarse;
  return take(*frame, *open, rect);
}

// Copies those rows of tile_ into the block that have not come before.
std::optional<BlockGatherer::Gathered> BlockGatherer::take(Frame& frame, Block& block, const geometry::Rect& rect) {
  ++statistics_.tiles;
  Gathered out;
  image::DepthImage& image = block.gathered.image;
  const auto width = static_cast<size_t>(rect.width);
  for (int y = 0; y < rect.height; ++y) {
    const auto row = static_cast<size_t>(rect.y - block.gathered.rect.y + y);
    if (block.has_row[row]) continue;
    block.has_row[row] = true;
    --block.rows_left;
    const size_t from = static_cast<size_t>(y) * width, to = row * width;
    std::copy_n(tile_.depth.data() + from, width, image.depth.data() + to);
    std::copy_n(tile_.colour.data() + from, width, image.colour.data() + to);
    std::copy_n(tile_.normal.data() + from, width, image.normal.data() + to);
    out.samples += covered(image, to, width);
  }
  if (block.rows_left > 0) return out;

  pixels_ -= image.pixels();
  out.block = std::move(block.gathered);
  frame.blocks.erase(frame.blocks.begin() + (&block - frame.blocks.data()));
  if (frame.blocks.empty()) std::erase_if(frames_, [](const Frame& f) { return f.blocks.empty(); });
  return out;
}

void BlockGatherer::clear() {
  frames_.clear();
  pixels_ = 0;
}

size_t BlockGatherer::open_blocks() const {
  size_t n = 0;
  for (const Frame& frame : frames_) n += frame.blocks.size();
  return n;
}

}  // namespace telesplat::packer
