#include "tools/telesplat/movie/movie_target.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "tools/telesplat/movie/encoder.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

constexpr int kMostDigits = 9;

// Whether something can be made in this folder, which may have to be made first.
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

// A video, or what takes its place.
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

std::string shell_quoted(const std::string& text) {
  if (!text.empty() && std::all_of(text.begin(), text.end(), [](unsigned char c) {
        return std::isalnum(c) || std::strchr("_-./%+,:@=", c) != nullptr;
      }))
    return text;
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

}  // namespace telesplat::launcher
