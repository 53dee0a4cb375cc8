#include "tools/telesplat/run/verify.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "client/viewer/record/frame_spool.h"
#include "common/image/quality.h"
#include "common/metrics/statistics.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

struct Verified {
  std::string path;
  uint64_t frame = 0;
  double t_s = 0;
  image::Quality quality;
};

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

Status write_summary(const std::string& directory, const std::vector<Verified>& views) {
  const std::string path = directory + "/summary.json";
  std::ifstream in(path);
  auto summary = nlohmann::ordered_json::parse(in, nullptr, false);
  if (!summary.is_object()) return Error{fmt::format("{}: cannot be read as JSON", path)};
  std::vector<double> psnr, ssim, holes;
  for (const auto& v : views) {
    if (v.quality.object_pixels == 0) continue;  // looking away from the data set: there is nothing to compare
    psnr.push_back(v.quality.psnr_db);
    ssim.push_back(v.quality.ssim);
    holes.push_back(v.quality.hole_fraction);
  }
  const auto precise = [](const metrics::Distribution& d) {
    return nlohmann::ordered_json{
        {"mean", d.mean}, {"median", d.median}, {"p95", d.p95}, {"p99", d.p99}, {"max", d.max}};
  };
  summary["quality"] = {{"views", psnr.size()},
                        {"views_without_object", views.size() - psnr.size()},
                        {"psnr_db", metrics::to_json(metrics::distribution(psnr))},
                        {"ssim", precise(metrics::distribution(ssim))},
                        {"hole_fraction", precise(metrics::distribution(holes))}};
  if (!views.empty())
    summary["quality"]["last_view"] = {{"psnr_db", views.back().quality.psnr_db},
                                       {"ssim", views.back().quality.ssim},
                                       {"hole_fraction", views.back().quality.hole_fraction}};
  std::ofstream out(path + ".part");
  out << summary.dump(2) << "\n";
  out.close();
  std::error_code error;
  if (out) fs::rename(path + ".part", path, error);
  if (!out || error) return Error{fmt::format("{}: cannot be written", path)};
  return ok_status();
}

}  // namespace

Status verify_run(const std::string& directory, DirectScene& scene, const image::ShadingParameters& shading,
                  const std::function<void(size_t, size_t)>& progress, const std::function<bool()>& should_stop) {
  const std::string spool = directory + "/spool";
  const auto paths = viewer::spooled_frames(spool);
  std::vector<Verified> views;
  for (size_t i = 0; i < paths.size() && !should_stop(); ++i) {
    const auto frame = viewer::read_spooled_frame(paths[i]);
    if (!frame) return frame.error();
    if (!(frame->use & viewer::kVerify) || frame->view.depth_m.empty()) continue;
    const auto reference = scene.draw(frame->camera, shading, frame->epoch);
    if (!reference) return reference.error();
    views.push_back({paths[i], frame->number, frame->t_s, scene.compare(*reference, frame->view, shading)});
    progress(i + 1, paths.size());
  }

  std::ofstream csv(directory + "/quality.csv");
  csv << "frame,t_s,psnr_db,ssim,hole_fraction,object_pixels\n";
  for (const auto& v : views)
    csv << fmt::format("{},{:.4f},{:.3f},{:.5f},{:.6f},{}\n", v.frame, v.t_s, v.quality.psnr_db, v.quality.ssim,
                       v.quality.hole_fraction, v.quality.object_pixels);

  std::vector<Verified> seen;
  std::copy_if(views.begin(), views.end(), std::back_inserter(seen),
               [](const Verified& v) { return v.quality.object_pixels > 0; });
  if (!seen.empty()) {
    const Verified last = seen.back();
    std::sort(seen.begin(), seen.end(),
              [](const auto& a, const auto& b) { return a.quality.psnr_db < b.quality.psnr_db; });
    for (const auto& [name, v] :
         {std::pair{"worst", seen.front()}, {"median", seen[seen.size() / 2]}, {"last", last}}) {
      const auto frame = viewer::read_spooled_frame(v.path);
      if (!frame) return frame.error();
      const auto reference = scene.draw(frame->camera, shading, frame->epoch);
      if (!reference) return reference.error();
      if (const Status s = image::write_png(fmt::format("{}/images/verify-{}-{:06d}.png", directory, name, v.frame),
                                            side_by_side(*reference, frame->view));
          !s)
        return s;
    }
  }
  std::error_code error;
  fs::remove_all(spool, error);
  return write_summary(directory, views);
}

}  // namespace telesplat::launcher
