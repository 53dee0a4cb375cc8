// Which rays of a view were cast and why, as a picture.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/core/ids.h"
#include "common/core/result.h"
#include "common/image/file.h"
#include "common/image/pixel_mask.h"

namespace telesplat::packer {

/// Why a pixel of a view is cast; or why not.
enum class RayClass : uint8_t { kNothing, kUnproven, kSparse, kEdge, kStale, kValidation, kGood, kKnownEmpty };
inline constexpr int kRayClasses = 8;
/// As in figures of plans: "nothing", "known_empty".
const char* name_of(RayClass c);

struct PlanPicture {
  FrameId frame;
  int width = 0, height = 0;
  std::vector<RayClass> classes;  ///< one a pixel: why it is cast, or kGood or kKnownEmpty
  std::vector<uint32_t> ground;   ///< what the model shows there, 0x00RRGGBB

  void reset(FrameId of, int w, int h);
  /// Pixels x0 to x0 + 63 of a row, those whose bits are set.
  void set(int x0, int y, uint64_t bits, RayClass c);
};

/// In grey what the model shows, in colours the rays, below it the legend.
image::View drawn(const PlanPicture& picture);

class PlanRecorder {
 public:
  /// Writes into `directory` (made if need be) as plan-NNNNNN.png, numbered by frames, at most `most` of them.
  static Result<PlanRecorder> open(const std::string& directory, int most);
  bool full() const { return left_ <= 0; }
  Status add(const PlanPicture& picture);

 private:
  std::string directory_;
  int left_ = 0;
};

}  // namespace telesplat::packer
