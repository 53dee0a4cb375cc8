#include "tools/telesplat/run/run_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/core/machine.h"
#include "tools/telesplat/record/skip.h"
#include "tools/telesplat/scene/scene.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kNotMeasured = "-";  // in place of a figure that was not measured

std::string plural(int n, const char* what) { return fmt::format("{} {}{}", n, what, n == 1 ? "" : "s"); }

// Returns the summary's value of this key, or null.
json at(const json& s, const char* key) {
  const auto found = s.find(key);
  return found == s.end() ? json() : *found;
}

std::string text_of(const json& s, const char* key) {
  const json v = at(s, key);
  return v.is_string() ? v.get<std::string>() : kNotMeasured;
}

// Formats value times `scale`.
std::string number(const json& value, const char* format, double scale = 1) {
  return value.is_number() ? fmt::format(fmt::runtime(format), value.get<double>() * scale) : kNotMeasured;
}

std::string size(const json& s, const char* key) {
  const json v = at(s, key);
  if (!v.is_array() || v.size() != 2) return kNotMeasured;
  return fmt::format("{}x{}", v[0].get<int>(), v[1].get<int>());
}

std::string distribution(const json& s, const char* key, const char* unit) {
  const json d = at(s, key);
  if (!d.is_object()) return kNotMeasured;
  return fmt::format("median {}  p95 {}  max {} {}", number(at(d, "median"), "{:.1f}"), number(at(d, "p95"), "{:.1f}"),
                     number(at(d, "max"), "{:.1f}"), unit);
}

std::string subject_of(const std::string& directory, const json& s) {
  const auto scene = recorded_scene(directory);
  if (!scene) return text_of(s, "scene");
  const json primitives = at(s, "primitives");
  return text_of(s, "scene") + (*scene)->summary(primitives.is_number() ? primitives.get<uint64_t>() : 0);
}

// True if the run was drawn from points: only then are there splats and cached points.
bool has_points(const json& s) {
  if (text_of(s, "coupling") == "images") return false;
  const auto kind = scene::kind_named(text_of(s, "kind"));
  return !kind || scene::pipeline_of(*kind) == scene::Pipeline::kPoints;
}

std::string head_of(const std::string& directory, const json& s) {
  std::string head =
      fmt::format("{}, display {}, sampling {}, {}, {} renderer", subject_of(directory, s), size(s, "size"),
                  size(s, "sampling_size"), plural(s.at("samplers").get<int>(), "sampler"), text_of(s, "renderer"));
  if (has_points(s)) head += ", " + text_of(s, "splat") + " splats";
  if (const int viewers = s.at("viewers").get<int>(); viewers > 1)
    head += fmt::format(", {} (figures of all)", plural(viewers, "viewer"));
  return head;
}

// Simulated links: one line for all equal ones.
void add_links(const json& s, RunReport& out) {
  const json links = at(s, "links");
  if (!links.is_object()) return;
  std::map<std::string, std::string> whose;
  for (const auto& [name, link] : links.items()) {
    auto& names = whose[link.get<std::string>()];
    names += (names.empty() ? "" : ", ") + name;
  }
  for (const auto& [link, names] : whose) out.line("simulated link", fmt::format("{} (of {})", link, names));
}

// Adds figures of the display that only some records have.
std::string beside_frames(const json& s) {
  std::string out;
  if (const json still = at(s, "frames_still"); still.is_number() && still.get<double>() > 0)
    out += fmt::format(", {} more of a picture that stood", still.get<uint64_t>());
  if (const json missed = at(s, "refreshes_missed"); missed.is_number())
    out += fmt::format(", {} refreshes missed", missed.get<uint64_t>());
  return out;
}

void add_display(const json& s, RunReport& out) {
  const std::string coupling = text_of(s, "coupling");
  const json still = at(s, "frames_still");
  const uint64_t drawn = s.at("frames").get<uint64_t>() - (still.is_number() ? still.get<uint64_t>() : 0);
  out.line("display",
           fmt::format("{} fps over {} frames{}, {} coupling{}", number(at(s, "fps"), "{:.1f}"), drawn,
                       beside_frames(s), coupling,
                       coupling == "loose" ? fmt::format(" of {} buffers", number(at(s, "buffers"), "{:.0f}")) : ""));
  out.line("motion to photon", distribution(s, "motion_to_photon_ms", "ms"));
  out.line("inter-frame delay", distribution(s, "inter_frame_delay_ms", "ms"));
  out.line("view construction", distribution(s, "view_construction_ms", "ms"));
}

std::string sent(const json& s) {
  if (at(s, "bytes_raw").is_null()) return kNotMeasured;
  return fmt::format("{} MB of {} MB sampled ({} : 1), {} MB/s", number(at(s, "bytes_sent"), "{:.2f}", 1e-6),
                     number(at(s, "bytes_raw"), "{:.0f}", 1e-6), number(at(s, "compression_ratio"), "{:.0f}"),
                     number(at(s, "data_transfer_rate_mb_s"), "{:.2f}"));
}

void add_updates(const json& s, RunReport& out) {
  out.line("view updates", fmt::format("{} per second, {} in all", number(at(s, "updates_per_s"), "{:.2f}"),
                                       s.at("updates").get<uint64_t>()));
  out.line("view update latency", distribution(s, "view_update_latency_ms", "ms"));
  const auto median = [&](const char* key) {
    const json d = at(s, key);
    return number(d.is_object() ? at(d, "median") : json(), "{:.1f}");
  };
  out.line("sampling / packing of a frame",
           fmt::format("median {} / {} ms", median("sampling_ms"), median("packing_ms")));
  if (has_points(s)) {
    out.line("points cached", fmt::format("{} M, {} bytes each", number(at(s, "points_cached"), "{:.2f}", 1e-6),
                                          number(at(s, "bytes_per_cached_point"), "{:.1f}")));
    out.line("redundancy eliminated", number(at(s, "redundancy_eliminated"), "{:.2f} %", 100));
  }
  if (at(s, "plans").is_number())
    out.line("rays cast",
             fmt::format("{} M of {} M ({} % saved), planned in median {} ms",
                         number(at(s, "rays_cast"), "{:.2f}", 1e-6), number(at(s, "rays_full"), "{:.2f}", 1e-6),
                         number(at(s, "rays_saved"), "{:.1f}", 100), median("plan_answer_ms")));
  out.line("sent to viewers", sent(s));
}

// Changes from frame to frame; no line if no two successive frames were compared.
void add_steadiness(const json& q, RunReport& out) {
  const json flicker = at(q, "flicker"), popping = at(q, "popping");
  if (!flicker.is_object() || !popping.is_object()) return;
  out.line("flicker / popping", fmt::format("median {} / {} of 255", number(at(flicker, "median"), "{:.2f}"),
                                            number(at(popping, "median"), "{:.1f}")));
  out.line("holes last", fmt::format("{} ms on average", number(at(q, "hole_lifetime_ms"), "{:.0f}")));
}

void add_quality(const json& s, RunReport& out) {
  const json q = at(s, "quality");
  if (!q.is_object()) return;
  const auto figure = [&](const char* key, const char* which) {
    const json d = at(q, key);
    return d.is_object() ? at(d, which) : json();
  };
  out.line("PSNR against direct rendering",
           fmt::format("median {} dB over {} views, {} rays a pixel", number(figure("psnr_db", "median"), "{:.2f}"),
                       q.at("views").get<int>(), number(at(q, "samples"), "{:.0f}")));
  out.line("SSIM / FLIP", fmt::format("median {} / {}", number(figure("ssim", "median"), "{:.4f}"),
                                      number(figure("flip", "median"), "{:.4f}")));
  out.line("hole fraction",
           fmt::format("median {} %  p95 {} %", number(figure("hole_fraction", "median"), "{:.3f}", 100),
                       number(figure("hole_fraction", "p95"), "{:.3f}", 100)));
  out.line("background covered / too near",
           fmt::format("median {} / {} %  p95 {} / {} %", number(figure("covered_fraction", "median"), "{:.3f}", 100),
                       number(figure("nearer_fraction", "median"), "{:.3f}", 100),
                       number(figure("covered_fraction", "p95"), "{:.3f}", 100),
                       number(figure("nearer_fraction", "p95"), "{:.3f}", 100)));
  add_steadiness(q, out);
  if (q.contains("last_view"))
    out.line("last view", fmt::format("PSNR {} dB, holes {} %", number(figure("last_view", "psnr_db"), "{:.2f}"),
                                      number(figure("last_view", "hole_fraction"), "{:.3f}", 100)));
}

void add_errors(const json& s, RunReport& out) {
  const auto& e = s.at("errors");
  const uint64_t expired = e.at("leases_expired").get<uint64_t>();
  out.line("errors", fmt::format("{} messages rejected, {} gaps resynchronised, {} leases expired{}",
                                 e.at("messages_rejected").get<uint64_t>(), e.at("gaps_resynced").get<uint64_t>(),
                                 expired, expired > 0 ? " (a slow sampler's work went to another)" : ""));
}

// Returns a name of the folder for commands: runs/latest if that leads to this run.
std::string called_next(const std::string& directory) {
  std::error_code error;
  const fs::path latest = fs::path(directory).lexically_normal().parent_path() / "latest";
  const bool is_it = fs::is_symlink(latest, error) && fs::equivalent(latest, directory, error) && !error;
  return shell_line({is_it ? latest.string() : directory});
}

// Prints commands for the record. Volumes, and runs without the record of points, cannot be replayed.
void print_next(const std::string& directory) {
  std::error_code error;
  std::string there;
  for (const char* file : {"summary.json", "frames.csv", "updates.csv", "tiles.csv", "trace.json", "images/"})
    if (const std::string path = directory + "/" + file; fs::exists(path, error) && !fs::is_empty(path, error))
      there += (there.empty() ? "" : ", ") + std::string(file);
  std::printf("\nEverything lies in %s (%s)\n", directory.c_str(), there.c_str());
  const std::string name = called_next(directory);
  const auto scene = recorded_scene(directory);
  if (scene && (*scene)->pipeline() == scene::Pipeline::kPoints && fs::exists(directory + "/points.events", error))
    std::printf("telesplat compare %s draws its frames with every kernel, beside direct rendering\n", name.c_str());
  else
    std::printf("telesplat inspect %s tells more\n", name.c_str());
}

namespace fs = std::filesystem;

struct File {
  std::string name;  // relative to the run folder
  uint64_t bytes = 0;
};

// Lists the folder's own files, then subfolders, each by name.
std::vector<File> files_below(const std::string& directory) {
  std::vector<File> out;
  std::error_code error;
  for (fs::recursive_directory_iterator entry(directory, error), end; !error && entry != end; entry.increment(error))
    if (entry->is_regular_file(error))
      out.push_back({entry->path().lexically_relative(directory).string(), uint64_t(entry->file_size(error))});
  const auto depth = [](const File& f) { return std::count(f.name.begin(), f.name.end(), '/') > 0; };
  std::sort(out.begin(), out.end(),
            [&](const File& a, const File& b) { return depth(a) != depth(b) ? depth(a) < depth(b) : a.name < b.name; });
  return out;
}

void describe_scene(const std::string& directory, data::Description& out) {
  std::error_code error;
  if (!fs::exists(directory + "/session.toml", error)) return;
  const auto scene = recorded_scene(directory);
  if (!scene) {
    out.row("scene", "cannot be told: " + scene.error().text);
    out.json["scene_error"] = scene.error().text;
    return;
  }
  std::istringstream lines((*scene)->describe_record());
  std::string line;
  for (bool first = true; std::getline(lines, line); first = false) out.row(first ? "scene" : "", line);
}

// A row for each of the folder's own files, one for all of a subfolder.
void describe_files(const std::string& directory, data::Description& out) {
  const std::vector<File> files = files_below(directory);
  std::map<std::string, std::pair<size_t, uint64_t>> folders;  // files, bytes
  uint64_t all = 0;
  for (const File& f : files) {
    all += f.bytes;
    out.json["files"].push_back({{"name", f.name}, {"bytes", f.bytes}});
  }
  out.row("files", fmt::format("{}, {}", files.size(), data::bytes_text(all)));
  for (const File& f : files) {
    const size_t slash = f.name.find('/');
    if (slash == f.name.npos) {
      out.row("", fmt::format("{:<18} {:>12} bytes", f.name, f.bytes));
      continue;
    }
    auto& [count, bytes] = folders[f.name.substr(0, slash + 1)];
    ++count, bytes += f.bytes;
  }
  for (const auto& [name, sum] : folders)
    out.row("", fmt::format("{:<18} {:>12} bytes in {} files", name, sum.second, sum.first));
}

}  // namespace

Result<RunReport> read_report(const std::string& directory, double skip_s) {
  const auto read = summary_without_beginning(directory, skip_s);
  if (!read) return read.error();
  const json s = *read;
  try {
    RunReport out{head_of(directory, s), {}};
    add_links(s, out);
    add_display(s, out);
    add_updates(s, out);
    add_quality(s, out);
    add_errors(s, out);
    return out;
  } catch (const json::exception&) {  // another program wrote the file
    return Error{directory + "/summary.json: lacks a figure, or has another thing in its place"};
  }
}

void print_report(const std::string& directory) {
  const auto report = read_report(directory);
  if (!report) return;
  std::printf("\n%s\n", report->head.c_str());
  for (const auto& [what, value] : report->lines) std::printf("  %-34s %s\n", what.c_str(), value.c_str());
  print_next(directory);
}

void print_joined(const std::string& directory, const std::string& master_folder) {
  std::printf(
      "\nPictures and what was received lie in %s (images/, points.events or slices.events, logs/); the figures %s\n",
      directory.c_str(),
      master_folder.empty() ? "are its master's, which keeps no record"
                            : ("will be in the session's record, " + master_folder + ", when it ends").c_str());
}

Result<data::Description> inspect_run(const std::string& directory, double skip_s) {
  auto summary = summary_without_beginning(directory, skip_s);
  if (!summary && skip_s > 0) return summary.error();
  if (!summary)
    return Error{
        fmt::format("{}: is a folder that holds neither a finished run, which has a summary.json, nor a volume: DICOM "
                    "slices or a numbered series of volume files ({})",
                    directory, summary.error().text)};
  data::Description out("run", fmt::format("{}: a run", directory));
  out.json["path"] = directory;
  out.json["summary"] = *std::move(summary);
  if (const auto report = read_report(directory, skip_s)) {
    out.row("shown", report->head);
    for (const auto& [what, value] : report->lines) out.row(what, value);
  } else {
    out.row("figures", "cannot be told: " + report.error().text);
  }
  describe_scene(directory, out);
  describe_files(directory, out);
  return out;
}

}  // namespace telesplat::launcher
