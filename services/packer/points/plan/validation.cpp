#include "services/packer/points/plan/validation.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>
#include <random>

#include "common/core/check.h"
#include "common/image/normal.h"

namespace telesplat::packer {
namespace {

// A cluster is disproved by kProof contradictions, twice as many after each time that forgetting it did not help, if
// they are kProofShare of all rays at it in about the last second.
constexpr float kProof = 16, kProofShare = 0.5f;
constexpr int kMostStrikes = 6;
constexpr double kHalfLifeSeconds = 0.5, kStrikeSeconds = 10;
constexpr size_t kMostEvidence = size_t{1} << 17;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

struct Around {
  float nearest_m = kInfinity, farthest_m = 0;
  std::array<int, 3> low{255, 255, 255}, high{0, 0, 0};
  float cosine = -1;  // with the most similar normal around
};

int channel(uint32_t colour, int c) { return static_cast<int>(colour >> (8 * c) & 255); }

// Returns the range of what is shown within `reach` pixels. A sample of the same surface lies within it.
Around look_around(const ShownView& shown, int x, int y, int reach, const glm::vec3& normal) {
  Around out;
  for (int py = std::max(y - reach, 0); py <= std::min(y + reach, shown.camera.height - 1); ++py)
    for (int px = std::max(x - reach, 0); px <= std::min(x + reach, shown.camera.width - 1); ++px) {
      const size_t i = static_cast<size_t>(py) * shown.camera.width + px;
      out.nearest_m = std::min(out.nearest_m, shown.depth_m[i]);
      out.farthest_m = std::max(out.farthest_m, shown.depth_m[i]);
      if (!(shown.depth_m[i] < kInfinity)) continue;
      for (int c = 0; c < 3; ++c) {
        auto& low = out.low[static_cast<size_t>(c)];
        auto& high = out.high[static_cast<size_t>(c)];
        low = std::min(low, channel(shown.colour[i], c));
        high = std::max(high, channel(shown.colour[i], c));
      }
      out.cosine = std::max(out.cosine, glm::dot(image::decode_normal16(shown.normal[i]), normal));
    }
  return out;
}

std::optional<points::ClusterKey> leaf_at(const points::OctreeGrid& grid, const glm::dvec3& position_room) {
  const glm::dvec3 at = glm::floor((position_room - grid.lo) / grid.leaf_size);
  const double side = 1 << grid.depth;
  for (int axis = 0; axis < 3; ++axis)
    if (!(at[axis] >= 0 && at[axis] < side)) return std::nullopt;
  return static_cast<points::ClusterKey>(at.x) | static_cast<points::ClusterKey>(at.y) << 10 |
         static_cast<points::ClusterKey>(at.z) << 20;
}

}  // namespace

Validation::Validation(const points::ModelConfig& model, const Tolerance& tolerance)
    : grid_(points::octree_grid(model)), tolerance_(tolerance) {}

Validation::Verdict Validation::judge(const ShownView& shown, int shown_x, int shown_y, const image::DepthImage& came,
                                      size_t pixel) const {
  const size_t i = static_cast<size_t>(shown_y) * shown.camera.width + static_cast<size_t>(shown_x);
  const bool hit = came.depth[pixel] != 0;
  if (!(shown.depth_m[i] < kInfinity)) return hit ? Verdict::kNearer : Verdict::kAgrees;
  const glm::vec3 normal = image::decode_normal16(came.normal[pixel]);
  const Around around = look_around(shown, shown_x, shown_y, tolerance_.reach, normal);
  // Beside a silhouette both a hit and a miss may be right.
  if (!hit) return around.farthest_m < kInfinity ? Verdict::kMissed : Verdict::kNone;
  const auto depth_m = static_cast<float>(image::decode_depth(came.depth[pixel], shown.camera.near_m));
  if (depth_m < around.nearest_m * (1 - tolerance_.relative_depth)) return Verdict::kNearer;
  if (depth_m > around.farthest_m * (1 + tolerance_.relative_depth)) return Verdict::kFarther;
  for (int c = 0; c < 3; ++c) {
    const auto v = static_cast<float>(channel(came.colour[pixel], c));
    const auto at = static_cast<size_t>(c);
    if (v < static_cast<float>(around.low[at]) - tolerance_.colour ||
        v > static_cast<float>(around.high[at]) + tolerance_.colour)
      return Verdict::kColour;
  }
  return around.cosine < tolerance_.normal_cosine ? Verdict::kNormal : Verdict::kAgrees;
}

void Validation::check(const ShownView& shown, const CastTile& tile, double now_s, image::PixelMask& contradicted) {
  const geometry::Rect& rect = tile.rect;
  const image::PixelMask& cast = tile.cast;
  const size_t pixels = static_cast<size_t>(shown.camera.width) * shown.camera.height;
  CHECK(shown.depth_m.size() == pixels && shown.colour.size() == pixels && shown.normal.size() == pixels);
  CHECK(shown.firm.width() == shown.camera.width && shown.firm.height() == shown.camera.height);
  CHECK(geometry::contains({0, 0, shown.camera.width, shown.camera.height}, rect));
  CHECK(cast.width() == rect.width && cast.height() == rect.height);
  CHECK(tile.came.width == rect.width && tile.came.height == rect.height);
  contradicted.reset(rect.width, rect.height);
  marked_.reset((rect.width + kMarkPixels - 1) / kMarkPixels, (rect.height + kMarkPixels - 1) / kMarkPixels);
  for (int y = 0; y < rect.height; ++y)
    image::for_each_set(cast.row(y), cast.words_per_row(), [&](size_t x) {
      const int column = static_cast<int>(x);
      if (!shown.firm.at(rect.x + column, rect.y + y)) return;
      if (take(shown, tile, column, y, now_s)) contradicted.set(column, y);
    });
}

// Takes one ray at a firm pixel. Returns true if it contradicts.
bool Validation::take(const ShownView& shown, const CastTile& tile, int x, int y, double now_s) {
  const auto& [rect, cast, came, doubted] = tile;
  const int px = rect.x + x, py = rect.y + y;
  const size_t at = static_cast<size_t>(y) * rect.width + x;
  const float shown_m = shown.depth_m[static_cast<size_t>(py) * shown.camera.width + px];
  const bool empty = !(shown_m < kInfinity);
  const Verdict verdict = judge(shown, px, py, came, at);
  count(verdict, empty);
  if (verdict == Verdict::kNone) return false;
  const auto room = [&](double depth_m) { return shown.camera.unproject(px + 0.5, py + 0.5, depth_m); };
  // A hit before the shown surface says nothing about that surface.
  if (!empty && verdict != Verdict::kNearer)
    if (const auto key = leaf_at(grid_, room(shown_m))) note(*key, verdict == Verdict::kAgrees, now_s);
  if (verdict == Verdict::kAgrees) return false;
  if (doubted && doubted->at(px, py)) return true;
  const int square_x = x / kMarkPixels, square_y = y / kMarkPixels;
  if (!marked_.at(square_x, square_y)) {
    marked_.set(square_x, square_y);
    const bool gone = verdict == Verdict::kFarther || verdict == Verdict::kMissed;
    mark(room(gone ? shown_m : image::decode_depth(came.depth[at], shown.camera.near_m)), now_s);
  }
  return true;
}

void Validation::count(Verdict verdict, bool empty) {
  if (verdict == Verdict::kNone) return;
  if (empty) {
    ++statistics_.empty_rays;
    statistics_.empty_hits += verdict != Verdict::kAgrees;
    return;
  }
  ++statistics_.rays;
  statistics_.nearer += verdict == Verdict::kNearer;
  statistics_.farther += verdict == Verdict::kFarther;
  statistics_.missed += verdict == Verdict::kMissed;
  statistics_.colour += verdict == Verdict::kColour;
  statistics_.normal += verdict == Verdict::kNormal;
}

void Validation::note(points::ClusterKey key, bool agrees, double now_s) {
  if (evidence_.size() >= kMostEvidence && !evidence_.contains(key)) evidence_.clear();
  Evidence& e = evidence_[key];
  if (now_s > e.s) {
    const auto fade = static_cast<float>(std::exp2(-(now_s - e.s) / kHalfLifeSeconds));
    e.agree *= fade, e.contradict *= fade;
    e.s = now_s;
  }
  (agrees ? e.agree : e.contradict) += 1;
  if (agrees) return;
  if (e.strikes > 0 && now_s - e.strike_s > kStrikeSeconds * (1 << e.strikes)) e.strikes = 0;
  const float proof = kProof * static_cast<float>(1 << e.strikes);
  if (e.contradict < proof || e.contradict < kProofShare * (e.agree + e.contradict)) return;
  disproved_.push_back(key);
  e = {0, 0, now_s, now_s, static_cast<uint8_t>(std::min(e.strikes + 1, kMostStrikes))};
}

void Validation::mark(const glm::dvec3& position_room, double now_s) {
  if (marks_.size() >= kMaxMarks) marks_.erase(marks_.begin(), marks_.begin() + kMaxMarks / 8);
  marks_.push_back({position_room, now_s, -1});
}

void Validation::mark_stale(const geometry::Camera& camera, double now_s, image::PixelMask& mask) {
  CHECK(mask.width() == camera.width && mask.height() == camera.height);
  std::erase_if(marks_, [&](const Mark& m) { return !(now_s - m.made_s <= kMarkSeconds); });
  const geometry::Camera::PixelTransform t = camera.room_to_pixel();
  for (Mark& m : marks_) {
    const glm::dvec4 p(m.position_room, 1);
    const double w = glm::dot(t.w, p);
    if (!(w > camera.near_m)) continue;
    const double x = std::floor(glm::dot(t.x, p) / w), y = std::floor(glm::dot(t.y, p) / w);
    if (!(x >= 0 && x < camera.width && y >= 0 && y < camera.height)) continue;
    constexpr int kHalf = kMarkPixels / 2;
    const int x0 = std::max(static_cast<int>(x) - kHalf, 0), y0 = std::max(static_cast<int>(y) - kHalf, 0);
    const int x1 = std::min(static_cast<int>(x) + kHalf, camera.width),
              y1 = std::min(static_cast<int>(y) + kHalf, camera.height);
    for (int py = y0; py < y1; ++py)
      for (int px = x0; px < x1; ++px) mask.set(px, py);
    m.planned_s = now_s;
  }
}

void Validation::resampled(double planned_s) {
  std::erase_if(marks_, [&](const Mark& m) { return m.planned_s == planned_s; });
}

std::vector<points::ClusterKey> Validation::disproved() {
  std::vector<points::ClusterKey> out;
  out.swap(disproved_);
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

void Validation::forgotten(std::span<const points::ClusterKey> clusters) {
  for (const points::ClusterKey key : clusters)
    if (const auto found = evidence_.find(key); found != evidence_.end())
      found->second.agree = found->second.contradict = 0;
}

void Validation::clear() {
  marks_.clear();
  evidence_.clear();
  disproved_.clear();
}

// ---- which rays are cast -------------------------------------------------------------------------------------------

namespace {

constexpr int kSide = BlueNoise::kSide, kPixels = kSide * kSide;
using Ranks = std::array<uint16_t, size_t{kPixels}>;

// Measures how crowded each pixel's surroundings are with chosen pixels: a Gaussian around each, on a torus.
class Crowding {
 public:
  Crowding() {
    for (int y = -kReach; y <= kReach; ++y)
      for (int x = -kReach; x <= kReach; ++x)
        kernel_[index(x + kReach, y + kReach)] = std::exp(static_cast<float>(-(x * x + y * y)) / (2 * kSigma * kSigma));
  }
  void change(int pixel, float sign) {
    const int cx = pixel % kSide, cy = pixel / kSide;
    for (int y = -kReach; y <= kReach; ++y)
      for (int x = -kReach; x <= kReach; ++x) {
        const int at = ((cy + y) & (kSide - 1)) * kSide + ((cx + x) & (kSide - 1));
        energy_[static_cast<size_t>(at)] += sign * kernel_[index(x + kReach, y + kReach)];
      }
    chosen_[static_cast<size_t>(pixel)] = sign > 0;
  }
  void choose(int pixel) { change(pixel, 1); }
  void drop(int pixel) { change(pixel, -1); }
  /// Returns the most crowded chosen pixel, or the least crowded other one. Such a pixel must exist.
  int tightest_cluster() const {
    return best(true, [](float a, float b) { return a > b; });
  }
  int largest_void() const {
    return best(false, [](float a, float b) { return a < b; });
  }
  bool chosen(int pixel) const { return chosen_[static_cast<size_t>(pixel)]; }

 private:
  static constexpr int kReach = 8;
  static constexpr float kSigma = 1.5f;  // Ulichney's choice
  static constexpr size_t index(int x, int y) { return static_cast<size_t>(y) * (2 * kReach + 1) + x; }

  template <class Better>
  int best(bool chosen, Better better) const {
    int found = -1;
    for (int i = 0; i < kPixels; ++i)
      if (chosen_[static_cast<size_t>(i)] == chosen &&
          (found < 0 || better(energy_[static_cast<size_t>(i)], energy_[static_cast<size_t>(found)])))
        found = i;
    return found;
  }

  std::array<float, size_t{2 * kReach + 1} * (2 * kReach + 1)> kernel_;
  std::array<float, size_t{kPixels}> energy_{};
  std::array<bool, size_t{kPixels}> chosen_{};
};

Ranks void_and_cluster() {
  constexpr int kFirst = kPixels / 16;
  Crowding crowding;
  std::mt19937 random(1);  // this engine gives the same numbers on all machines
  for (int n = 0; n < kFirst;) {
    const auto pixel = static_cast<int>(random() % kPixels);
    if (crowding.chosen(pixel)) continue;
    crowding.choose(pixel);
    ++n;
  }
  // Spread the first pixels: the most crowded one moves to the largest void, until it would move back.
  for (int n = 0; n < kPixels; ++n) {
    const int from = crowding.tightest_cluster();
    crowding.drop(from);
    const int to = crowding.largest_void();
    crowding.choose(to);
    if (to == from) break;
  }
  Ranks ranks{};
  Crowding first = crowding;
  for (int rank = kFirst - 1; rank >= 0; --rank) {
    const int pixel = first.tightest_cluster();
    first.drop(pixel);
    ranks[static_cast<size_t>(pixel)] = static_cast<uint16_t>(rank);
  }
  for (int rank = kFirst; rank < kPixels; ++rank) {
    const int pixel = crowding.largest_void();
    crowding.choose(pixel);
    ranks[static_cast<size_t>(pixel)] = static_cast<uint16_t>(rank);
  }
  return ranks;
}

}  // namespace

const std::array<uint16_t, size_t{BlueNoise::kSide} * BlueNoise::kSide>& blue_noise_ranks() {
  static const Ranks ranks = void_and_cluster();
  return ranks;
}

// Pixels of neighbouring ranks avoid each other, so each run of ranks is spread evenly.
BlueNoise::BlueNoise(int share) : share_(std::clamp(share, 1, kMaxShare)) {
  rows_.resize(static_cast<size_t>(share_) * kSide);
  for (int i = 0; i < kPixels; ++i) {
    const auto set = static_cast<size_t>(blue_noise_ranks()[static_cast<size_t>(i)]) * static_cast<size_t>(share_) /
                     static_cast<size_t>(kPixels);
    rows_[set * kSide + static_cast<size_t>(i / kSide)] |= uint64_t{1} << (i % kSide);
  }
}

uint64_t BlueNoise::row(int y, uint64_t round) const {
  return rows_[(round % static_cast<uint64_t>(share_)) * kSide + static_cast<unsigned>(y & (kSide - 1))];
}

}  // namespace telesplat::packer
