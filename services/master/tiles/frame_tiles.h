// The tiles of one sampling frame: open, leased to samplers, or done. Only when a sampler leaves does a step look at
// all of them. Frames by rows (T7.3) are handed out as blocks from the middle outward, and as bands of whole rows that
// are carved from the blocks as samplers ask.
#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/core/ids.h"
#include "common/wire/tile_messages.h"

namespace telesplat::master {

/// A sampler that reports that it needs longer for a tile has this much more time until another one gets a copy.
inline constexpr double kHeardFor_s = 2.0;

/// Cuts a frame into tiles of tile_size, those nearest the centre first (that is where the person looks).
std::vector<geometry::Rect> cut_tiles(int width, int height, int tile_size);

inline constexpr int kBlockRows = 64;  ///< rows of a block, which is packed and published at once

/// Blocks of kBlockRows rows, as wide as the frame, the last of the image may be lower; those nearest the middle row
/// first (that is where the person looks, and where rows take longest, so that the frame ends with cheap ones).
std::vector<geometry::Rect> cut_blocks(int width, int height);

/// Carves bands from the blocks, one block after the other, each from its top.
class RowBands {
 public:
  RowBands() = default;  ///< for a frame that is not handed out by rows: nothing to carve
  explicit RowBands(const std::vector<geometry::Rect>& blocks);

  struct Band {
    size_t block = 0;
    geometry::Rect rect;
  };
  int rows_left() const { return rows_left_; }
  /// Returns the next band: `rows` rows, or the rows that the block has left. Precondition: rows >= 1, rows_left() > 0.
  Band carve(int rows);

 private:
  std::vector<geometry::Rect> blocks_;
  size_t block_ = 0;
  int begun_rows_ = 0;  // rows carved from block_
  int rows_left_ = 0;
};

/// Guided self-scheduling (Polychronopoulos and Kuck, 1987) with a target: as many rows as take target_s, but no more
/// than a third of an equal share of what is left (rounded up), so that all finish together. At least 1. row_s: seconds
/// that a row takes this sampler; 0: not known yet, which gives 1 row.
int band_rows(double target_s, double row_s, int rows_left, size_t samplers);

class FrameTiles {
 public:
  /// Square tiles, each a block of its own; larger ones where there would be more than 1024.
  static FrameTiles of_squares(int width, int height, int tile_size);
  /// `bands` bands of about equal height, with whole rows of JPEG blocks and no more pixels than a tile may have, each
  /// a block of its own.
  static FrameTiles of_bands(int width, int height, size_t bands);
  /// Bands of rows, carved when they are taken.
  static FrameTiles of_rows(int width, int height);
  /// The tiles of a plan, in its order, each a block of its own. Precondition: wire::check(plan).
  static FrameTiles of_plan(const wire::Plan& plan);

  struct Tile {
    geometry::Rect rect;
    size_t block = 0;
    enum class State { kOpen, kLeased, kDone } state = State::kOpen;
    std::array<LeaseId, 3> leases;          ///< leases that are out, oldest first; 0: free. Later ones are copies
    std::string given_up_by;                ///< sampler whose lease ran out, or whose tile was refused
    int refused = 0;                        ///< times that the packer could not use the tile
    int lost = 0;                           ///< times that a lease of it ran out, or its sampler left
    uint64_t rays = 0;                      ///< rays to be cast
    size_t mask_begin = 0, mask_words = 0;  ///< place in masks_; 0 words: all pixels
  };
  /// A lease that is out.
  struct Out {
    size_t tile;
    std::string sampler;
    double leased_s;
    double heard_s;  ///< time of the lease, or of its last extension
    double expires_s;
  };

  /// True if a sampler delivers what it is leased.
  using Trusts = std::function<bool(const std::string& sampler)>;

  bool open() const { return !closed_ && (!reopened_.empty() || unleased_ < tiles_.size() || rows_.rows_left() > 0); }
  /// True if leases are out.
  bool any_out() const { return !out_.empty(); }
  /// True if leases are out with a trusted sampler.
  bool any_out(const Trusts& trusts) const {
    return std::any_of(held_.begin(), held_.end(), [&](const auto& held) { return trusts(held.first); });
  }
  bool complete() const { return closed_ ? out_.empty() : done_ == tiles_.size() && rows_.rows_left() == 0; }
  /// Drops open tiles; tiles that are out may still come.
  void close() { closed_ = true; }
  bool closed() const { return closed_; }
  /// Number of tiles that are carved and not done.
  size_t left() const { return tiles_.size() - done_; }
  /// True if each tile is a block of its own: tiles that came can be shown though others do not come.
  bool whole_blocks() const { return rows_.rows_left() == 0 && tiles_.size() == blocks_.size(); }
  int rows_left() const { return rows_.rows_left(); }
  const Tile& tile(size_t i) const { return tiles_[i]; }
  size_t tiles() const { return tiles_.size(); }
  const std::vector<geometry::Rect>& blocks() const { return blocks_; }
  /// See wire::Lease::mask.
  std::span<const uint32_t> mask(const Tile& tile) const {
    return std::span(masks_).subspan(tile.mask_begin, tile.mask_words);
  }

  /// Returns a tile to lease to `sampler`: first those taken back, then those never leased, carved with `rows` rows.
  /// Tiles whose lease ran out at this very sampler only if even_own. The tile counts as leased from lease() on, which
  /// must follow.
  std::optional<size_t> take(const std::string& sampler, int rows, bool even_own);
  /// Returns the tile that has been out longest of those whose leases are all late, that have room for one more and
  /// that `sampler` does not have (nullptr: any sampler). A lease from before before_s is late, unless its sampler is
  /// trusted and reported since that it needs longer, which counts for kHeardFor_s.
  std::optional<size_t> overdue(double before_s, const std::string* sampler, const Trusts& trusts) const;
  /// Returns the tile that has been out shortest of those that one trusted sampler alone has.
  std::optional<size_t> to_copy(const Trusts& trusts) const;

  /// Precondition: the tile came from take(), overdue() or to_copy(). Lease ids rise.
  void lease(size_t tile, LeaseId id, const std::string& sampler, double now_s, double expires_s);
  /// False: the lease is not out with this sampler.
  bool extend(LeaseId id, const std::string& sampler, double now_s, double expires_s);
  /// nullptr: the lease is not out.
  const Out* out(LeaseId id) const;
  /// Marks a tile as done and ends all its leases. False: it was done, was never leased or does not exist.
  bool done(uint64_t tile);

  /// The packer cannot use a tile: takes back this sampler's lease. Returns the number of refusals of the tile; 0: it
  /// is done, was never leased or does not exist.
  int refuse(uint64_t tile, const std::string& sampler);
  /// True if an open tile was refused or lost more often than this.
  bool hopeless(int most_refused, int most_lost) const;

  /// Take back leases that ran out, or those of a sampler; a tile without leases is open again. Return their number.
  int expire(double now_s, const std::function<void(const std::string&)>& lost_sampler);
  int release(const std::string& sampler);
  size_t leases_of(const std::string& sampler) const;

 private:
  bool is_late(const Out& out, double before_s, const Trusts& trusts) const;
  std::map<LeaseId, Out>::iterator take_back(std::map<LeaseId, Out>::iterator lease);
  std::map<LeaseId, Out>::iterator end(std::map<LeaseId, Out>::iterator lease);

  std::vector<geometry::Rect> blocks_;
  std::vector<Tile> tiles_;
  std::vector<uint32_t> masks_;
  RowBands rows_;
  bool closed_ = false;
  size_t unleased_ = 0;                           // tiles before it were leased at least once
  std::set<size_t> reopened_;                     // those of them that are open again
  std::map<LeaseId, Out> out_;                    // oldest first
  std::unordered_map<std::string, size_t> held_;  // leases out, by sampler
  size_t done_ = 0;
};

}  // namespace telesplat::master
