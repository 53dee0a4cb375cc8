#include "tools/telesplat/bench/thesis/steps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

namespace telesplat::launcher {
namespace {

using Words = std::vector<std::string>;

void add_figures(const StepOptions& o, std::vector<Step>& out) {
  const int seconds = o.quick ? 4 : 8;
  for (const auto& [figure, coupling, title] : thesis_couplings())
    out.push_back(
        {"6", fmt::format("figure {}, {} coupling", figure, coupling), fmt::format("figure-{}", figure),
         Words{"run", o.data + "/" + thesis_meshes().front().file, "--coupling", coupling, "--size", "1280x800",
               "--sampling-size", "1280x800", "--duration", std::to_string(seconds), "--record-points", "0"},
         "", seconds + 10.0});
}

void add_meshes(const StepOptions& o, std::vector<Step>& out) {
  const int seconds = o.quick ? 5 : 20;
  for (const ThesisMesh& mesh : thesis_meshes()) {
    const std::string file = o.data + "/" + mesh.file, folder = fmt::format("table-7.1/{}", mesh.name);
    out.push_back({"7.1", fmt::format("table 7.1, {}", mesh.name), folder,
                   Words{"run", file, "--size", fmt::format("{}x{}", kThesisWidth, kThesisHeight), "--sampling-size",
                         "1280x800", "--duration", std::to_string(seconds), "--record-points", "0"},
                   "", seconds + 15.0});
    out.push_back({"7.1", fmt::format("table 7.1, {} without points", mesh.name), folder + "-direct", {}, file, 15});
  }
}

void add_volumes(const StepOptions& o, std::vector<Step>& out) {
  const std::string seconds = o.quick ? "1" : "4";
  const double each_s = o.quick ? 8 : 14;
  out.push_back({"7.3", "table 7.3, 4 x 4", "table-7.3",
                 Words{"bench", "volume", "--volume", o.data + "/volumes/bonsai.nii.gz", "--samplers", "1,2,3,4",
                       "--viewers", "1,2,3,4", "--seconds", seconds},
                 "", 32 * each_s});
  out.push_back({"7.4", "table 7.4, 6 x 4", "table-7.4",
                 Words{"bench", "volume", "--generated", o.quick ? "128" : "512", "--samplers", "1,2,3,4,5,6",
                       "--viewers", "1,2,3,4", "--seconds", seconds},
                 "", 48 * each_s * (o.quick ? 1 : 2)});
}

void add_scaling(const StepOptions& o, std::vector<Step>& out) {
  Words words{"bench",
              "scaling",
              "--no-kill",
              "--nodes",
              o.quick ? "1,2,4,8" : "1,2,4,8,16,32,40",
              "--row-cost",
              o.quick ? "cheap" : "both"};
  out.push_back({"7.2", "table 7.2", "table-7.2", std::move(words), "", o.quick ? 60.0 : 330.0});
}

}  // namespace

const std::vector<ThesisMesh>& thesis_meshes() {
  static const std::vector<ThesisMesh> all{
      {"Crater Lake", "5 M", 1, 17, "colorado", "meshes/colorado-5760k.ply",
       "another terrain, about as many triangles"},
      {"Crater Lake", "5 M", 1, 17, "crater-lake", "meshes/crater-lake-srtm3-2880k.ply",
       "the same place, from another survey, fewer triangles"},
      {"Bone, skin, head together", "1.2 M", 4, 18, "head", "meshes/head-t1-4100k.ply",
       "another head, from MR instead of CT, more triangles"},
      {"Bone, skin, head together", "1.2 M", 4, 18, "bone", "meshes/alderson-bone-718k.ply",
       "bones of a phantom, fewer triangles"},
      {"Skull", "0.45 M", 12, 20, "cranium", "formats/cranium-bone.vtp", "another skull"}};
  return all;
}

const std::vector<ThesisCoupling>& thesis_couplings() {
  static const std::vector<ThesisCoupling> all{{"6.1", "sync", "synchronized client-server coupling"},
                                               {"6.2", "loose", "loose client-server coupling"},
                                               {"6.3", "async", "asynchronous client-server coupling"}};
  return all;
}

const std::vector<std::string>& thesis_parts() {
  static const std::vector<std::string> all{"6", "7.1", "7.2", "7.3", "7.4"};
  return all;
}

Result<std::vector<std::string>> parse_parts(const std::string& text) {
  std::vector<std::string> out;
  const auto& known = thesis_parts();
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size());
    const std::string part = text.substr(begin, end - begin);
    if (std::find(known.begin(), known.end(), part) == known.end())
      return Error{fmt::format("\"{}\" is none of {}", part, fmt::join(known, ", "))};
    out.push_back(part);
    begin = end + 1;
  }
  return out;
}

std::vector<Step> steps(const StepOptions& o) {
  std::vector<Step> all, out;
  add_figures(o, all);
  add_meshes(o, all);
  add_scaling(o, all);
  add_volumes(o, all);
  for (Step& step : all)
    if (std::find(o.parts.begin(), o.parts.end(), step.part) != o.parts.end()) out.push_back(std::move(step));
  return out;
}

std::string default_data_folder() {
  const auto variable = [](const char* name) { return std::string(std::getenv(name) ? std::getenv(name) : ""); };
  if (const auto folder = variable("TELESPLAT_DATA"); !folder.empty()) return folder;
  const std::string cache = variable("XDG_CACHE_HOME");
  return (cache.empty() ? variable("HOME") + "/.cache" : cache) + "/telesplat-data";
}

}  // namespace telesplat::launcher
