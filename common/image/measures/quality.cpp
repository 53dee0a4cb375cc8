#include "common/image/measures/quality.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "common/parallel/in_parallel.h"

namespace telesplat::image {
namespace {

constexpr int kRadius = 5;  // 11 x 11 window
constexpr double kSigma = 1.5;
constexpr float kC1 = 0.01f * 255 * 0.01f * 255, kC2 = 0.03f * 255 * 0.03f * 255;
// Luma is stored minus 128: variances do not change, and single precision keeps two more bits of them.
constexpr float kLumaOffset = 128;

bool shows(float depth_m) { return depth_m < std::numeric_limits<float>::infinity(); }

struct Sums {
  double squared_error = 0;  // over three channels
  double ssim = 0;
  size_t pixels = 0, object = 0, holes = 0;
  Sums operator+(const Sums& o) const {
    return {squared_error + o.squared_error, ssim + o.ssim, pixels + o.pixels, object + o.object, holes + o.holes};
  }
  void add_pixel(const View& reference, const View& reconstruction, size_t at) {
    ++pixels;
    const uint32_t c = reference.colour[at], d = reconstruction.colour[at];
    int squared = 0;
    for (int shift : {16, 8, 0}) {
      const int e = static_cast<int>(c >> shift & 255) - static_cast<int>(d >> shift & 255);
      squared += e * e;
    }
    squared_error += squared;
    object += shows(reference.depth_m[at]);
    holes += is_hole(reference, reconstruction, at);
  }
};

// Pixels that show more than there is.
struct Excess {
  size_t covered = 0, nearer = 0;
  Excess operator+(const Excess& o) const { return {covered + o.covered, nearer + o.nearer}; }
  void add(float nearest_m, float shown_m) {
    if (!shows(shown_m)) return;
    covered += !shows(nearest_m);
    nearer += shows(nearest_m) && shown_m < 0.99f * nearest_m;
  }
};

std::array<float, 2 * kRadius + 1> gaussian() {
  std::array<float, 2 * kRadius + 1> w{};
  for (int i = -kRadius; i <= kRadius; ++i)
    w[i + kRadius] = static_cast<float>(std::exp(-i * i / (2 * kSigma * kSigma)));
  return w;
}

// 1 / (sum of the weights that fall inside [0, size)): windows are cut at the image's edges and normalised to the rest.
std::vector<float> window_scales(int size, const std::array<float, 2 * kRadius + 1>& w) {
  std::vector<float> scales(size);
  for (int i = 0; i < size; ++i) {
    float sum = 0;
    for (int k = -kRadius; k <= kRadius; ++k) sum += i + k >= 0 && i + k < size ? w[k + kRadius] : 0;
    scales[i] = 1 / sum;
  }
  return scales;
}

float luma(uint32_t c) {
  return 0.299f * static_cast<float>(c >> 16 & 255) + 0.587f * static_cast<float>(c >> 8 & 255) +
         0.114f * static_cast<float>(c & 255) - kLumaOffset;
}

// Window moments of one row: means of x, of y, of x^2 + y^2 and of x y. Lines are padded by the radius on either side.
class RowMoments {
 public:
  explicit RowMoments(int width) : width_(width) {
    for (auto& l : vertical_) l.assign(width + 2 * kRadius, 0.0f);
    for (auto& l : means_) l.resize(width);
  }

  void clear() {
    for (auto& l : vertical_) std::fill(l.begin(), l.end(), 0.0f);
  }

  void add_row(const float* x, const float* y, float weight) {
    float* __restrict a = vertical_[0].data() + kRadius;
    float* __restrict b = vertical_[1].data() + kRadius;
    float* __restrict s = vertical_[2].data() + kRadius;
    float* __restrict p = vertical_[3].data() + kRadius;
    for (int i = 0; i < width_; ++i) {
      const float wx = weight * x[i], wy = weight * y[i];
      a[i] += wx;
      b[i] += wy;
      s[i] += wx * x[i] + wy * y[i];
      p[i] += wx * y[i];
    }
  }

  void filter_across(const std::array<float, 2 * kRadius + 1>& w, const std::vector<float>& scale_x, float scale_y) {
    for (int m = 0; m < 4; ++m) {
      const float* in = vertical_[m].data();
      float* __restrict out = means_[m].data();
      for (int i = 0; i < width_; ++i) {
        float sum = w[0] * in[i];
        for (int k = 1; k <= 2 * kRadius; ++k) sum += w[k] * in[i + k];
        out[i] = sum * scale_x[i] * scale_y;
      }
    }
  }

  // Wang et al. 2004, equation 13.
  float ssim(int i) const {
    const float mx = means_[0][i], my = means_[1][i];
    const float variances = means_[2][i] - mx * mx - my * my, covariance = means_[3][i] - mx * my;
    const float lx = mx + kLumaOffset, ly = my + kLumaOffset;
    return (2 * lx * ly + kC1) * (2 * covariance + kC2) / ((lx * lx + ly * ly + kC1) * (variances + kC2));
  }

 private:
  int width_;
  std::array<std::vector<float>, 4> vertical_, means_;
};

// nearest_m: nearest depth of each pixel's rays.
void add_excess(const float* nearest_m, const View& reconstruction, Quality& q) {
  const size_t pixels = reconstruction.depth_m.size();
  const auto shown = [&](const tbb::blocked_range<size_t>& range, Excess sum) {
    for (size_t i = range.begin(); i < range.end(); ++i) sum.add(nearest_m[i], reconstruction.depth_m[i]);
    return sum;
  };
  const Excess excess = sum_in_parallel(tbb::blocked_range<size_t>(0, pixels, 65536), Excess{}, shown,
                                        [](const Excess& a, const Excess& b) { return a + b; });
  q.covered_fraction = static_cast<double>(excess.covered) / static_cast<double>(pixels);
  q.nearer_fraction = static_cast<double>(excess.nearer) / static_cast<double>(pixels);
}

// hits: number of rays in each pixel of the reference that met the data; null: one ray, whose depth shows it.
// nearest_m: nearest depth of each pixel's rays; null: one ray.
Quality compare_counted(const View& reference, const uint16_t* hits, const float* nearest_m,
                        const View& reconstruction) {
  const int width = reference.width, height = reference.height;
  const size_t pixels = size_t(width) * height;
  CHECK(reconstruction.width == width && reconstruction.height == height);
  for (const View* v : {&reference, &reconstruction}) CHECK(v->colour.size() == pixels && v->depth_m.size() == pixels);

  std::vector<float> x(pixels), y(pixels);
  in_parallel(tbb::blocked_range<size_t>(0, pixels, 65536), [&](const tbb::blocked_range<size_t>& range) {
    for (size_t i = range.begin(); i < range.end(); ++i)
      x[i] = luma(reference.colour[i]), y[i] = luma(reconstruction.colour[i]);
  });

  const auto w = gaussian();
  const auto scale_x = window_scales(width, w), scale_y = window_scales(height, w);
  const auto rows = [&](const tbb::blocked_range<int>& range, Sums sums) {
    RowMoments moments(width);
    for (int row = range.begin(); row < range.end(); ++row) {
      const size_t at = size_t(row) * width;
      const auto in_union = [&](int i) {
        return (hits ? hits[at + i] > 0 : shows(reference.depth_m[at + i])) || shows(reconstruction.depth_m[at + i]);
      };
      int first = 0;
      while (first < width && !in_union(first)) ++first;
      if (first == width) continue;  // background only

      moments.clear();
      for (int k = std::max(-kRadius, -row); k <= std::min(kRadius, height - 1 - row); ++k)
        moments.add_row(x.data() + size_t(row + k) * width, y.data() + size_t(row + k) * width, w[k + kRadius]);
      moments.filter_across(w, scale_x, scale_y[row]);

      for (int i = first; i < width; ++i) {
        if (!in_union(i)) continue;
        sums.add_pixel(reference, reconstruction, at + i);
        sums.ssim += moments.ssim(i);
      }
    }
    return sums;
  };
  // Deterministic: the same views give the same figures for any number of threads.
  const Sums sums = sum_in_parallel(tbb::blocked_range<int>(0, height, 32), Sums{}, rows,
                                    [](const Sums& a, const Sums& b) { return a + b; });

  Quality q;
  q.object_pixels = sums.object;
  q.hole_pixels = sums.holes;
  if (sums.pixels == 0) return q;  // no pixel shows more than there is
  const double mean_squared = sums.squared_error / (3.0 * static_cast<double>(sums.pixels));
  q.psnr_db = mean_squared > 0 ? std::min(99.0, 10 * std::log10(255.0 * 255.0 / mean_squared)) : 99.0;
  q.ssim = sums.ssim / static_cast<double>(sums.pixels);
  if (sums.object > 0) q.hole_fraction = static_cast<double>(sums.holes) / static_cast<double>(sums.object);
  add_excess(nearest_m ? nearest_m : reference.depth_m.data(), reconstruction, q);
  return q;
}

const uint16_t* hits_of(const Reference& r) {
  CHECK(r.hits.empty() || r.hits.size() == r.view.colour.size());
  return r.hits.empty() ? nullptr : r.hits.data();
}

}  // namespace

Quality compare(const Reference& reference, const View& reconstruction) {
  const auto& nearest = reference.nearest_m;
  return compare_counted(reference.view, hits_of(reference), nearest.empty() ? nullptr : nearest.data(),
                         reconstruction);
}

Quality compare(const View& reference, const View& reconstruction) {
  return compare_counted(reference, nullptr, nullptr, reconstruction);
}

bool counts(const Reference& r, const View& reconstruction, size_t at) {
  return (r.hits.empty() ? shows(r.view.depth_m[at]) : r.hits[at] > 0) || shows(reconstruction.depth_m[at]);
}

bool is_hole(const View& reference, const View& reconstruction, size_t at) {
  return shows(reference.depth_m[at]) && !(reconstruction.depth_m[at] <= 1.01f * reference.depth_m[at]);
}

double mean_error(const std::vector<float>& map, const Reference& reference, const View& reconstruction) {
  CHECK(map.size() == reference.view.colour.size() && map.size() == reconstruction.depth_m.size());
  double sum = 0;
  size_t count = 0;
  for (size_t i = 0; i < map.size(); ++i) {
    if (!counts(reference, reconstruction, i)) continue;
    sum += map[i];
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : 0;
}

double flip(const Reference& reference, const View& reconstruction, double pixels_per_degree) {
  return mean_error(Flip(reference.view, pixels_per_degree).error_map(reconstruction), reference, reconstruction);
}

}  // namespace telesplat::image
