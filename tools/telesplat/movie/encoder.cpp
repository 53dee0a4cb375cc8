#include "tools/telesplat/movie/encoder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "common/core/check.h"

namespace telesplat::launcher {
namespace {

using Arguments = std::vector<std::string>;

// Pictures are sRGB with all codes; players expect video of BT.709 primaries and the narrow range.
const Arguments kColours{"-vf",
                         "scale=in_range=full:out_range=tv:out_color_matrix=bt709",
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

// The first of them that this ffmpeg has.
Result<const Container::Encoder*> choose_encoder(const std::string& ffmpeg, const Container& container,
                                                 const ShouldStop& should_stop) {
  auto process = PipedProcess::start(ffmpeg, {"-nostdin", "-hide_banner", "-loglevel", "error", "-encoders"});
  if (!process) return process.error();
  if (const int code = process->finish(should_stop); code != 0)
    return Error{fmt::format("{} ended with code {}: {}", ffmpeg, code, process->last_error_line())};
  const std::string known = process->output();
  std::string names;
  for (const auto& encoder : container.encoders) {
    if (known.find(" " + encoder.name + " ") != known.npos) return &encoder;
    names += (names.empty() ? "" : " or ") + encoder.name;
  }
  return Error{fmt::format("{} has no encoder {} for {} files", ffmpeg, names, container.extension)};
}

std::string part_of(const std::string& path) { return path + ".part"; }

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

Result<std::unique_ptr<Encoder>> Encoder::start(const std::string& ffmpeg, const std::string& path, int width,
                                                int height, double fps, const ShouldStop& should_stop) {
  const Container* container = container_of(path);
  CHECK(container);
  if (container->even_sides) width -= width % 2, height -= height % 2;
  if (width < 1 || height < 1) return Error{fmt::format("{}: a video has at least 2x2 pixels", path)};
  const auto encoder = choose_encoder(ffmpeg, *container, should_stop);
  if (!encoder) return encoder.error();
  Arguments arguments{"-nostdin",
                      "-hide_banner",
                      "-loglevel",
                      "error",
                      "-y",
                      "-f",
                      "rawvideo",
                      "-pixel_format",
                      "bgr0",
                      "-video_size",
                      fmt::format("{}x{}", width, height),
                      "-framerate",
                      fmt::format("{}", fps),
                      "-i",
                      "pipe:0",
                      "-an",
                      "-c:v",
                      (*encoder)->name};
  arguments = joined(std::move(arguments), (*encoder)->arguments);
  // "file:" keeps names from being taken for options or protocols.
  arguments = joined(std::move(arguments), {"-f", container->format, "file:" + part_of(path)});
  std::remove(part_of(path).c_str());  // ffmpeg would write through a link
  auto process = PipedProcess::start(ffmpeg, arguments);
  if (!process) return process.error();
  return std::unique_ptr<Encoder>(new Encoder(std::move(*process), path, (*encoder)->name, width, height, should_stop));
}

Encoder::Encoder(PipedProcess process, std::string path, std::string encoder, int width, int height,
                 ShouldStop should_stop)
    : process_(std::move(process)),
      path_(std::move(path)),
      encoder_(std::move(encoder)),
      width_(width),
      height_(height),
      should_stop_(std::move(should_stop)) {}

Encoder::~Encoder() {
  if (done_) return;
  { const PipedProcess ended = std::move(process_); }
  std::remove(part_of(path_).c_str());
}

Error Encoder::failed(int code) const {
  const std::string line = process_.last_error_line();
  return {fmt::format("{}: ffmpeg ended with code {}{}{}", path_, code, line.empty() ? "" : ": ", line)};
}

Status Encoder::add(const image::View& picture) {
  CHECK(picture.width >= width_ && picture.height >= height_);
  for (int y = 0; y < height_; ++y) {
    const std::span row(picture.colour.data() + size_t(y) * size_t(picture.width), size_t(width_));
    if (!process_.write(std::as_bytes(row), should_stop_)) {
      if (should_stop_()) return Error{fmt::format("{}: interrupted", path_)};
      return failed(process_.finish(should_stop_));
    }
  }
  return ok_status();
}

Status Encoder::finish() {
  if (const int code = process_.finish(should_stop_); code != 0) return failed(code);
  std::error_code error;
  std::filesystem::rename(part_of(path_), path_, error);
  if (error) return Error{fmt::format("{}: cannot be written: {}", path_, error.message())};
  done_ = true;
  return ok_status();
}

}  // namespace telesplat::launcher
