#include "tools/telesplat/run/verify.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>

#include "client/viewer/record/frame_spool.h"
#include "common/core/whole_file.h"
#include "common/metrics/statistics.h"
#include "tools/common/json_file.h"

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

// Qualities differ in thousandths: they need more digits than times.
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
  std::vector<double> psnr, ssim, flip, holes, covered, nearer, flicker, popping;
};

Columns columns_of(const std::vector<VerifiedView>& views) {
  Columns c;
  for (const auto& v : views) {
    if (v.change && v.change->unsteadiness.pixels > 0) {
      c.flicker.push_back(v.change->unsteadiness.flicker);
      c.popping.push_back(v.change->unsteadiness.popping);
    }
    if (v.quality.object_pixels == 0) continue;  // the view does not show the data set: no quality
    c.psnr.push_back(v.quality.psnr_db);
    c.ssim.push_back(v.quality.ssim);
    c.flip.push_back(v.flip);
    c.holes.push_back(v.quality.hole_fraction);
    c.covered.push_back(v.quality.covered_fraction);
    c.nearer.push_back(v.quality.nearer_fraction);
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

namespace fs = std::filesystem;

// reference | displayed | absolute difference x 4.
image::View side_by_side(const image::View& a, const image::View& b) {
  image::View out{3 * a.width, a.height, std::vector<uint32_t>(size_t(3) * a.width * a.height), {}};
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x) {
      const uint32_t p = a.colour[size_t(y) * a.width + x], q = b.colour[size_t(y) * a.width + x];
      uint32_t difference = 0;
      for (int shift : {0, 8, 16}) {
        const int d = std::abs(int(p >> shift & 255) - int(q >> shift & 255));
        difference |= uint32_t(std::min(255, 4 * d)) << shift;
      }
      uint32_t* row = &out.colour[size_t(y) * out.width];
      row[x] = p;
      row[a.width + x] = q;
      row[2 * a.width + x] = difference;
    }
  return out;
}

// Adds "quality" to summary.json.
Status write_summary(const std::string& directory, const std::vector<VerifiedView>& views) {
  const std::string path = directory + "/summary.json";
  auto summary = tools::read_json_object(path);
  if (!summary) return summary.error();
  (*summary)["quality"] = quality_json(views);
  return write_whole(path, summary->dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n",
                     kPrivate);
}

class Verification {
 public:
  Verification(DirectScene& scene, const VerifyOptions& options) : scene_(scene), options_(options) {}

  /// Call in the order of frame numbers.
  Status compare(const std::string& path) {
    auto read = viewer::read_spooled_frame(path);
    if (!read) return read.error();
    if (!(read->use & viewer::kVerify) || read->view.depth_m.empty()) return ok_status();
    auto reference = scene_.draw_reference(read->camera, options_.shading, read->epoch, options_.samples);
    if (!reference) return reference.error();
    Frame now{*std::move(read), *std::move(reference)};
    scene_.mark_shown(now.frame.view);
    if (now.frame.use & viewer::kPictureOnly) now.frame.view.depth_m = now.reference.view.depth_m;
    VerifiedView v{
        .frame = now.frame.number, .t_s = now.frame.t_s, .samples = now.reference.samples, .eye = now.frame.eye};
    std::optional<Frame>& before = before_[v.eye];  // the last frame of this eye
    v.quality = image::compare(now.reference, now.frame.view);
    v.flip = image::flip(now.reference, now.frame.view);
    if (before && before->frame.number + 1 == now.frame.number && alike(before->frame.camera, now.frame.camera))
      v.change = change(*before, now);
    views_.push_back(v);
    paths_.push_back(path);
    before = std::move(now);
    return ok_status();
  }

  const std::vector<VerifiedView>& views() const { return views_; }

  /// Writes pictures of the worst, the median and the last view that shows the data set.
  Status write_pictures(const std::string& directory) const {
    std::vector<size_t> seen;
    for (size_t i = 0; i < views_.size(); ++i)
      if (views_[i].quality.object_pixels > 0) seen.push_back(i);
    if (seen.empty()) return ok_status();
    const size_t last = seen.back();
    std::stable_sort(seen.begin(), seen.end(),
                     [&](size_t a, size_t b) { return views_[a].quality.psnr_db < views_[b].quality.psnr_db; });
    for (const auto& [name, i] : {std::pair{"worst", seen.front()}, {"median", seen[seen.size() / 2]}, {"last", last}})
      if (const Status s = write_picture(directory, name, i); !s) return s;
    return ok_status();
  }

 private:
  struct Frame {
    viewer::SpooledFrame frame;
    image::Reference reference;
  };

  static bool alike(const geometry::Camera& a, const geometry::Camera& b) {
    return a.width == b.width && a.height == b.height;
  }

  VerifiedView::Change change(const Frame& before, const Frame& now) const {
    const image::VerifiedFrame a{before.frame.camera, before.reference, before.frame.view};
    const image::VerifiedFrame b{now.frame.camera, now.reference, now.frame.view};
    VerifiedView::Change out{now.frame.t_s - before.frame.t_s, image::unsteadiness(a, b), {}};
    if (scene_.has_surface() && before.frame.epoch == now.frame.epoch) out.holes = image::follow_holes(a, b);
    return out;
  }

  Status write_picture(const std::string& directory, const char* name, size_t i) const {
    const auto frame = viewer::read_spooled_frame(paths_[i]);
    if (!frame) return frame.error();
    const auto reference = scene_.draw_reference(frame->camera, options_.shading, frame->epoch, options_.samples);
    if (!reference) return reference.error();
    constexpr const char* kEyes[] = {"", "-left", "-right"};
    return image::write_png(
        fmt::format("{}/images/verify-{}{}-{:06d}.png", directory, name, kEyes[frame->eye], frame->number),
        side_by_side(reference->view, frame->view));
  }

  DirectScene& scene_;
  const VerifyOptions& options_;
  std::vector<VerifiedView> views_;
  std::vector<std::string> paths_;              // files of views_
  std::array<std::optional<Frame>, 3> before_;  // last frame for both eyes, the left, the right
};

}  // namespace

std::string quality_csv(const std::vector<VerifiedView>& views) {
  std::string out =
      "frame,t_s,samples,psnr_db,ssim,flip,hole_fraction,object_pixels,"
      "covered_fraction,nearer_fraction,flicker,popping,holes_followed,holes_closed,eye\n";
  for (const auto& v : views)
    out += fmt::format("{},{:.4f},{},{:.3f},{:.5f},{:.5f},{:.6f},{},{:.6f},{:.6f},{},{}\n", v.frame, v.t_s, v.samples,
                       v.quality.psnr_db, v.quality.ssim, v.flip, v.quality.hole_fraction, v.quality.object_pixels,
                       v.quality.covered_fraction, v.quality.nearer_fraction, change_columns(v), v.eye);
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
                   {"covered_fraction", precise(c.covered)},
                   {"nearer_fraction", precise(c.nearer)},
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

Status verify_run(const std::string& directory, DirectScene& scene, const VerifyOptions& options,
                  const std::function<void(size_t, size_t)>& progress, const std::function<bool()>& should_stop) {
  const std::string spool = directory + "/spool";
  const auto paths = viewer::spooled_frames(spool);
  Verification verification(scene, options);
  for (size_t i = 0; i < paths.size() && !should_stop(); ++i) {
    if (const Status s = verification.compare(paths[i]); !s) return s;
    progress(i + 1, paths.size());
  }
  std::ofstream(directory + "/quality.csv") << quality_csv(verification.views());
  if (const Status s = verification.write_pictures(directory); !s) return s;
  std::error_code error;
  fs::remove_all(spool, error);
  return write_summary(directory, verification.views());
}

}  // namespace telesplat::launcher
