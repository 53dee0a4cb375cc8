#include "tools/telesplat/movie/encoder.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <thread>

#include "common/core/check.h"
#include "common/core/whole_file.h"
#include "tools/telesplat/run/child_process.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;
using Arguments = std::vector<std::string>;

constexpr uint64_t kMostLog = 1 << 20;

// Pictures are sRGB with all codes; players expect video of BT.709 primaries and the narrow range.
const Arguments kColours{"-vf",
                         "crop=trunc(iw/2)*2:trunc(ih/2)*2,scale=in_range=full:out_range=tv:out_color_matrix=bt709",
                         "-pix_fmt",
                         "yuv420p",
                         "-colorspace",
                         "bt709",
                         "-color_trc",
                         "bt709",
                         "-color_primaries",
                         "bt709",
                         "-color_range",
                         "tv"};

Arguments joined(Arguments a, const Arguments& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

const std::vector<Container>& containers() {
  const std::vector<Container::Encoder> h264{{"libx264", joined({"-crf", "18", "-preset", "medium"}, kColours)},
                                             {"mpeg4", joined({"-qscale:v", "2"}, kColours)}};
  std::vector<Container::Encoder> fast_start = h264;  // players may begin before they have the whole file
  for (auto& e : fast_start) e.arguments = joined(e.arguments, {"-movflags", "+faststart"});
  const std::vector<Container::Encoder> vp9{
      {"libvpx-vp9",
       joined({"-crf", "24", "-b:v", "0", "-row-mt", "1", "-deadline", "good", "-cpu-used", "4"}, kColours)},
      {"libvpx", joined({"-crf", "8", "-b:v", "20M"}, kColours)}};
  // A palette of its own for each picture, so that none must wait for the last one.
  const std::vector<Container::Encoder> gif{
      {"gif", {"-filter_complex", "[0:v]split[a][b];[a]palettegen=stats_mode=single[p];[b][p]paletteuse=new=1"}}};
  static const std::vector<Container> all{
      {".mp4", "mp4", fast_start}, {".m4v", "mp4", fast_start}, {".mov", "mov", fast_start}, {".mkv", "matroska", h264},
      {".avi", "avi", h264},       {".webm", "webm", vp9},      {".gif", "gif", gif, false}};
  return all;
}

std::string lower_case(std::string text) {
  for (char& c : text) c = char(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

std::string part_of(const std::string& path) { return path + ".part"; }

// Runs ffmpeg to its end. What it writes to its output. log: a file for what it complains of.
Result<std::string> run(const std::string& ffmpeg, const Arguments& arguments, const std::string& log,
                        const tools::ShouldStop& should_stop) {
  auto process = ChildProcess::start("ffmpeg", ffmpeg,
                                     joined({"-nostdin", "-hide_banner", "-loglevel", "error"}, arguments), log, 0);
  if (!process) return process.error();
  std::string out;
  for (bool ended = false; !ended; std::this_thread::sleep_for(std::chrono::milliseconds(5))) {
    if (should_stop()) return Error{"interrupted"};
    ended = process->ended();
    for (const auto& line : process->read_lines()) out += line + "\n";
  }
  if (process->exit_code() == 0) return out;
  const auto complaints = read_whole(log, kMostLog);
  std::string said = complaints ? *complaints : "";
  said.erase(said.find_last_not_of("\r\n") + 1);
  const std::string line = said.substr(said.find_last_of("\r\n") + 1);
  return Error{fmt::format("ffmpeg ended with code {}{}{}", process->exit_code(), line.empty() ? "" : ": ", line)};
}

// The first of the encoders that this ffmpeg has.
Result<const Container::Encoder*> choose_encoder(const std::string& ffmpeg, const Container& container,
                                                 const std::string& log, const tools::ShouldStop& should_stop) {
  const auto known = run(ffmpeg, {"-encoders"}, log, should_stop);
  if (!known) return known.error();
  std::string names;
  for (const auto& encoder : container.encoders) {
    if (known->find(" " + encoder.name + " ") != known->npos) return &encoder;
    names += (names.empty() ? "" : " or ") + encoder.name;
  }
  return Error{fmt::format("{} has no encoder {} for {} files", ffmpeg, names, container.extension)};
}

// Names of numbered pictures, as ffmpeg reads them: only one % may mean something, and no protocol stands in front.
std::string pattern_in(const std::string& folder) {
  std::error_code error;
  std::string out;
  for (const char c : fs::absolute(folder, error).string()) out += c == '%' ? std::string("%%") : std::string(1, c);
  return out + "/%06d.png";
}

}  // namespace

const Container* container_of(const std::string& path) {
  const std::string extension = lower_case(std::filesystem::path(path).extension().string());
  const auto& all = containers();
  const auto found = std::find_if(all.begin(), all.end(), [&](const Container& c) { return c.extension == extension; });
  return found == all.end() ? nullptr : &*found;
}

std::string container_names() {
  std::string out;
  for (const auto& c : containers()) out += (out.empty() ? "" : ", ") + c.extension;
  return out;
}

Result<std::string> encode_video(const std::string& ffmpeg, const std::string& folder, const std::string& path,
                                 double fps, const tools::ShouldStop& should_stop) {
  const Container* container = container_of(path);
  CHECK(container);
  const std::string log = folder + "/ffmpeg.log";
  const auto encoder = choose_encoder(ffmpeg, *container, log, should_stop);
  if (!encoder) return Error{fmt::format("{}: {}", path, encoder.error().text)};
  Arguments arguments{"-y",
                      "-f",
                      "image2",
                      "-pattern_type",
                      "sequence",
                      "-framerate",
                      fmt::format("{}", fps),
                      "-start_number",
                      "0",
                      "-i",
                      pattern_in(folder),
                      "-an",
                      "-c:v",
                      (*encoder)->name};
  arguments = joined(std::move(arguments), (*encoder)->arguments);
  // "file:" keeps names from being taken for options or protocols.
  arguments = joined(std::move(arguments), {"-f", container->format, "file:" + part_of(path)});
  std::error_code error;
  fs::remove(part_of(path), error);  // ffmpeg would write through a link
  const auto done = run(ffmpeg, arguments, log, should_stop);
  if (done) fs::rename(part_of(path), path, error);
  if (done && !error) return (*encoder)->name;
  const std::string why = done ? "cannot be written: " + error.message() : done.error().text;
  fs::remove(part_of(path), error);
  return Error{fmt::format("{}: {}", path, why)};
}

}  // namespace telesplat::launcher
