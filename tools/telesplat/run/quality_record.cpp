#include "tools/telesplat/run/quality_record.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "common/metrics/statistics.h"

namespace telesplat::launcher {
namespace {

using nlohmann::ordered_json;

std::string change_columns(const VerifiedView& v) {
  if (!v.change) return ",,,";
  const auto& u = v.change->unsteadiness;
  std::string out = u.pixels > 0 ? fmt::format("{:.4f},{:.4f}", u.flicker, u.popping) : ",";
  if (const auto& holes = v.change->holes) return out + fmt::format(",{},{}", holes->followed, holes->closed);
  return out + ",,";
}

// Quality lies in thousandths: more digits than of times.
ordered_json precise(const std::vector<double>& values) { return metrics::distribution_json(values, 9); }

ordered_json last_view(const std::vector<VerifiedView>& views) {
  if (views.empty()) return nullptr;
  const VerifiedView& v = views.back();
  return {{"psnr_db", v.quality.psnr_db},
          {"ssim", v.quality.ssim},
          {"flip", v.flip},
          {"hole_fraction", v.quality.hole_fraction}};
}

struct Columns {
  std::vector<double> psnr, ssim, flip, holes, flicker, popping;
};

Columns columns_of(const std::vector<VerifiedView>& views) {
  Columns c;
  for (const auto& v : views) {
    if (v.change && v.change->unsteadiness.pixels > 0) {
      c.flicker.push_back(v.change->unsteadiness.flicker);
      c.popping.push_back(v.change->unsteadiness.popping);
    }
    if (v.quality.object_pixels == 0) continue;  // looking away from the data set: there is nothing to compare
    c.psnr.push_back(v.quality.psnr_db);
    c.ssim.push_back(v.quality.ssim);
    c.flip.push_back(v.flip);
    c.holes.push_back(v.quality.hole_fraction);
  }
  return c;
}

ordered_json quality_json_of_eye(const std::vector<VerifiedView>& views) {
  const Columns c = columns_of(views);
  return {{"views", c.psnr.size()},
          {"psnr_db", metrics::distribution_json(c.psnr)},
          {"flip", precise(c.flip)},
          {"hole_fraction", precise(c.holes)}};
}

}  // namespace

std::string quality_csv(const std::vector<VerifiedView>& views) {
  std::string out =
      "frame,t_s,samples,psnr_db,ssim,flip,hole_fraction,object_pixels,flicker,popping,"
      "holes_followed,holes_closed,eye\n";
  for (const auto& v : views)
    out +=
        fmt::format("{},{:.4f},{},{:.3f},{:.5f},{:.5f},{:.6f},{},{},{}\n", v.frame, v.t_s, v.samples, v.quality.psnr_db,
                    v.quality.ssim, v.flip, v.quality.hole_fraction, v.quality.object_pixels, change_columns(v), v.eye);
  return out;
}

std::optional<double> hole_lifetime_ms(const std::vector<VerifiedView>& views) {
  double hole_seconds = 0, closed = 0;
  for (const auto& v : views) {
    if (!v.change || !v.change->holes) continue;
    hole_seconds += double(v.change->holes->followed) * v.change->since_s;
    closed += double(v.change->holes->closed);
  }
  if (closed == 0) return {};
  return 1e3 * hole_seconds / closed;
}

ordered_json quality_json(const std::vector<VerifiedView>& views) {
  const Columns c = columns_of(views);
  const auto lifetime = hole_lifetime_ms(views);
  ordered_json out{{"samples", views.empty() ? ordered_json() : ordered_json(views.front().samples)},
                   {"views", c.psnr.size()},
                   {"views_without_object", views.size() - c.psnr.size()},
                   {"psnr_db", metrics::distribution_json(c.psnr)},
                   {"ssim", precise(c.ssim)},
                   {"flip", precise(c.flip)},
                   {"hole_fraction", precise(c.holes)},
                   {"flicker", precise(c.flicker)},
                   {"popping", precise(c.popping)},
                   {"hole_lifetime_ms", lifetime ? ordered_json(*lifetime) : ordered_json()}};
  if (!views.empty()) out["last_view"] = last_view(views);
  for (const auto& [eye, name] : {std::pair{1u, "left"}, {2u, "right"}}) {
    std::vector<VerifiedView> of_eye;
    std::copy_if(views.begin(), views.end(), std::back_inserter(of_eye),
                 [eye = eye](const VerifiedView& v) { return v.eye == eye; });
    if (!of_eye.empty()) out["eyes"][name] = quality_json_of_eye(of_eye);
  }
  return out;
}

}  // namespace telesplat::launcher
