#include "tools/telesplat/movie/movie_target.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <thread>

#include "client/viewer/display/size_text.h"
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
  // Each picture has its own palette, so that it need not wait for the last one.
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

// Runs ffmpeg to its end; returns its output. log: file for its complaints.
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

// Returns the first of the encoders that this ffmpeg has.
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

// Pattern of numbered pictures for ffmpeg: only one % may mean something, and no protocol stands in front.
std::string pattern_in(const std::string& folder) {
  std::error_code error;
  std::string out;
  for (const char c : fs::absolute(folder, error).string()) out += c == '%' ? std::string("%%") : std::string(1, c);
  return out + "/%06d.png";
}

const options::Range kFps{0.1, 1000};

namespace fs = std::filesystem;

constexpr int kMostDigits = 9;

// Checks that a file can be made in this folder; the folder itself may still be missing.
Status check_folder(fs::path folder, const std::string& path) {
  std::error_code error;
  folder = fs::absolute(folder.empty() ? "." : folder, error);
  while (!fs::exists(folder, error) && folder.has_relative_path()) folder = folder.parent_path();
  if (!fs::is_directory(folder, error)) return Error{fmt::format("{}: {} is no folder", path, folder.string())};
  std::string probe = (folder / ".telesplat-XXXXXX").string();
  if (!mkdtemp(probe.data())) return Error{fmt::format("{}: cannot be written: {}", path, std::strerror(errno))};
  rmdir(probe.c_str());
  return ok_status();
}

Status check_file(const std::string& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) return Error{fmt::format("{}: is a folder", path)};
  if (fs::exists(path, error) && !fs::is_regular_file(path, error))
    return Error{fmt::format("{}: is there and no ordinary file", path)};
  return check_folder(fs::path(path).parent_path(), path);
}

// Pictures of another movie would stay beside those of this one.
Status check_pictures(const MovieTarget& target) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(target.path, error)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(target.prefix) || !name.ends_with(target.suffix) ||
        name.size() <= target.prefix.size() + target.suffix.size())
      continue;
    const std::string number =
        name.substr(target.prefix.size(), name.size() - target.prefix.size() - target.suffix.size());
    if (number.find_first_not_of("0123456789") == number.npos)
      return Error{
          fmt::format("{}: holds pictures already ({}); name another folder, or remove them", target.path, name)};
  }
  return check_folder(target.path, target.path);
}

// Reads "NAME%06d.png". Error: another pattern. path: for error texts.
Status read_pattern(const std::string& name, const std::string& path, MovieTarget& out) {
  const Error wrong{fmt::format("{}: pictures are numbered by one %d, %06d or the like before .png", path)};
  const size_t percent = name.find('%'), d = name.find('d', percent);
  if (d == name.npos || name.find('%', d) != name.npos) return wrong;
  const std::string width = name.substr(percent + 1, d - percent - 1);
  const bool sound =
      width.empty() || (width.size() == 2 && width[0] == '0' && width[1] >= '1' && width[1] <= '0' + kMostDigits);
  if (!sound) return wrong;
  out.digits = width.empty() ? 1 : width[1] - '0';
  out.prefix = name.substr(0, percent);
  out.suffix = name.substr(d + 1);
  return out.suffix == ".png" ? ok_status() : Status(wrong);
}

Result<MovieTarget> pictures(const std::string& name) {
  MovieTarget out;
  out.kind = MovieTarget::Kind::kPictures;
  const fs::path path(name);
  const bool numbered = path.filename().string().find('%') != std::string::npos;
  if (numbered)
    if (const Status s = read_pattern(path.filename().string(), name, out); !s) return s.error();
  out.path = (numbered ? path.parent_path() : path).string();
  if (out.path.empty()) out.path = ".";
  if (const Status s = check_pictures(out); !s) return s.error();
  return out;
}

// Returns a video, or the pictures that take its place.
Result<MovieTarget> video(const std::string& name) {
  MovieTarget out;
  out.path = name;
  out.ffmpeg = find_program("ffmpeg");
  if (!out.ffmpeg.empty()) {
    if (const Status s = check_file(name); !s) return s.error();
    return out;
  }
  auto instead = pictures(fs::path(name).replace_extension().string() + "-frames/");
  if (instead) instead->wanted_video = name;
  return instead;
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
  fs::remove(part_of(path), error);  // ffmpeg would write through a link of that name
  const auto done = run(ffmpeg, arguments, log, should_stop);
  if (done) fs::rename(part_of(path), path, error);
  if (done && !error) return (*encoder)->name;
  const std::string why = done ? "cannot be written: " + error.message() : done.error().text;
  fs::remove(part_of(path), error);
  return Error{fmt::format("{}: {}", path, why)};
}

options::Table movie_rows(MovieOptions& o) {
  return {
      {.flag = "--movie",
       .value = &o.file,
       .help = "after the run make a movie of the frames that were displayed: FILE.mp4 (or .mov, .mkv, .avi, .webm, "
               ".gif, through ffmpeg), a folder/ or folder/%06d.png of pictures, FILE.png for a contact sheet",
       .not_in_scene = "where a run writes"},
      {.flag = "--movie-fps", .value = &o.fps, .help = "frames a second of the movie", .limits = kFps},
      {.flag = "--movie-size", .value = &o.size, .help = "pixels of the movie, WxH; default: the display's"}};
}

options::Table movie_table(MovieOptions& o) {
  return {{.flag = "--fps", .value = &o.fps, .help = "frames a second of the movie", .limits = kFps},
          {.flag = "--size", .value = &o.size, .help = "pixels of a frame, WxH; default: the display's"},
          {.flag = "--pictures",
           .value = &o.pictures,
           .help = "pictures of a contact sheet, evenly spaced in time",
           .limits = options::Range{1, 400}},
          {.flag = "--threads",
           .value = &o.threads,
           .help = "threads to draw with; 0: one a core",
           .limits = options::Range{0, 1024}}};
}

Result<std::pair<int, int>> movie_size(const MovieOptions& o, const char* flag) {
  if (o.size.empty()) return std::pair{0, 0};
  return viewer::parse_size(o.size, flag);
}

std::string MovieTarget::picture(uint64_t n) const {
  return (fs::path(path) / fmt::format("{}{:0{}}{}", prefix, n, digits, suffix)).string();
}

std::string MovieTarget::pattern() const {
  return (fs::path(path) / fmt::format("{}%0{}d{}", prefix, digits, suffix)).string();
}

Result<MovieTarget> movie_target(const std::string& name) {
  std::error_code error;
  const fs::path path(name);
  const std::string file = path.filename().string();
  if (file.empty() || file == "." || file == ".." || fs::is_directory(path, error) ||
      file.find('%') != std::string::npos)
    return pictures(name);
  if (container_of(name)) return video(name);
  if (path.extension() != ".png")
    return Error{
        fmt::format("{}: ends in none of {}, nor in / for a folder of pictures, nor in .png for a contact sheet", name,
                    container_names())};
  MovieTarget out;
  out.kind = MovieTarget::Kind::kSheet;
  out.path = name;
  if (const Status s = check_file(name); !s) return s.error();
  return out;
}

std::string find_program(const std::string& name) {
  const char* path = std::getenv("PATH");
  std::string folders = path ? path : "";
  for (size_t begin = 0; begin < folders.size();) {
    const size_t end = std::min(folders.find(':', begin), folders.size());
    const std::string program = folders.substr(begin, end - begin) + "/" + name;
    std::error_code error;
    if (program.front() == '/' && program.size() > name.size() + 1 && access(program.c_str(), X_OK) == 0 &&
        fs::is_regular_file(program, error))
      return program;
    begin = end + 1;
  }
  return {};
}

}  // namespace telesplat::launcher
