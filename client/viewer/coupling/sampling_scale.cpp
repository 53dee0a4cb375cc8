#include "client/viewer/coupling/sampling_scale.h"

#include <algorithm>
#include <cmath>

namespace telesplat::viewer {

constexpr double kFirstPixels = 1280 * 800;  // adaptive sampling begins with this size
// Steered: another resolution makes much of the model too coarse or needlessly fine, so it changes by octaves of
// pixels, and only after several updates that agree.
constexpr double kScaleStep = 0.70710678118654752;
constexpr int kSlowUpdates = 3, kFastUpdates = 2;
// kSteeredAim is a share of the target latency, the others are shares of that time.
constexpr double kSteeredAim = 0.5, kFastEnough = 0.6, kTooSlow = 1.5, kFarOff = 3;

double SamplingScale::of(const geometry::Camera& display, double least) {
  if (scale_ == 0) scale_ = std::clamp(std::sqrt(kFirstPixels / (double(display.width) * display.height)), least, 1.0);
  return scale_ = std::clamp(scale_, least, 1.0);
}

// Time is proportional to the number of pixels, hence the root. On a slow link a few large views would take seconds.
// The step is small, since views differ.
void SamplingScale::follow(double own_s, double target_s, double least) {
  slow_ = own_s > 2 * target_s ? slow_ + 1 : 0;
  const double least_step = slow_ >= 2 ? 0.5 : 0.85;
  scale_ = std::clamp(scale_ * std::clamp(std::sqrt(target_s / own_s), least_step, 1.1), least, 1.0);
}

// Steered views need few rays, however many pixels they have, and results stay: frequent views show more than fine
// ones. On a terrain at 2560x1600, aiming at the whole target gave the same PSNR and a quarter fewer updates. The
// time of a view that was sampled whole is proportional to its pixels: one that took far too long is enough.
void SamplingScale::follow_steered(double own_s, double target_s, bool whole, double least) {
  const double aim_s = kSteeredAim * target_s;
  slow_ = own_s > kTooSlow * aim_s ? slow_ + 1 : 0;
  fast_ = own_s < kFastEnough * aim_s ? fast_ + 1 : 0;
  const bool far_off = whole && own_s > kFarOff * aim_s;
  if (!far_off && slow_ < kSlowUpdates && fast_ < kFastUpdates) return;
  const double octaves = far_off ? std::ceil(std::log2(own_s / (kTooSlow * aim_s))) : slow_ > 0 ? 1 : -1;
  scale_ = std::clamp(scale_ * std::pow(kScaleStep, octaves), least, 1.0);
  slow_ = fast_ = 0;
}

}  // namespace telesplat::viewer
