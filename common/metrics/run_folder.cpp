#include "common/metrics/run_folder.h"

#include <fmt/format.h>
#include <fnmatch.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "common/core/log.h"
#include "common/core/machine.h"
#include "common/core/whole_file.h"

namespace telesplat::metrics {
namespace {

namespace fs = std::filesystem;

constexpr const char* kIdFile = "run.id";
constexpr std::string_view kIdWord = "telesplat-run ";
constexpr uint64_t kMostIdBytes = 4096;
constexpr const char* kLatest = "latest";
constexpr const char* kReplaced = ".replaced";

/// Files that we write: patterns of names in a folder of a record. Other files, such as a person's screenshots or
/// notes, are not ours.
struct Ours {
  const char* folder;
  std::vector<const char*> names;
};
const std::vector<Ours>& ours() {
  static const std::vector<Ours> table{
      {"",
       {"summary.json", "summary.json*.part", "frames.csv", "updates.csv", "stages.csv", "tiles.csv", "plans.csv",
        "epochs.csv", "assignment.csv", "quality.csv", "trace.json", "session.toml", "session.toml*.part", "lives.csv",
        ".room", "points.events", "slices.events", "report.html", "report.html*.part"}},
      {"images", {"frame-*.png", "frame-*.exr", "verify-*.png", "wall.png", "contact-sheet.png"}},
      {"depth", {"frame-*.depth", "cameras.csv"}},
      {"plans", {"plan-*.png"}},
      {"spool", {"*.frame", "*.frame.part"}},
      {"compare", {"contact-sheet.png", "pose-*.png", "compare.csv*", "compare.json*"}},
      {"compare-still", {"contact-sheet.png", "pose-*.png", "compare.csv*", "compare.json*"}},
  };
  return table;
}
const Ours kLogFiles{"logs", {"*.log"}};

bool is_folder(const fs::path& path) {
  std::error_code error;
  return fs::symlink_status(path, error).type() == fs::file_type::directory;
}

bool is_ours(const Ours& of, const std::string& name) {
  return std::any_of(of.names.begin(), of.names.end(),
                     [&](const char* pattern) { return fnmatch(pattern, name.c_str(), FNM_PERIOD) == 0; });
}

/// Files, folders and links with names of ours in a record's folder.
struct Found {
  std::vector<std::string> files, folders, links;  ///< relative to the folder; folders: inner ones first
};

// prefix: for the found names, "" or "viewer-2/".
void look(const fs::path& directory, const std::string& prefix, const Ours& of, Found& out) {
  const std::string inner = *of.folder ? prefix + of.folder + "/" : prefix;
  const fs::path folder = directory / inner;
  std::error_code error;
  if (fs::is_symlink(fs::symlink_status(directory / (prefix + of.folder), error))) {
    out.links.push_back(prefix + of.folder);
    return;
  }
  if (!is_folder(folder)) return;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (!is_ours(of, name)) continue;
    const auto type = entry->symlink_status(error).type();
    if (type == fs::file_type::symlink) out.links.push_back(inner + name);
    if (type == fs::file_type::regular) out.files.push_back(inner + name);
  }
  if (*of.folder) out.folders.push_back(prefix + of.folder);
}

void look_everywhere(const fs::path& directory, const std::string& prefix, Logs logs, Found& out) {
  for (const Ours& of : ours()) look(directory, prefix, of, out);
  if (logs == Logs::kOurs) look(directory, prefix, kLogFiles, out);
}

// Further viewers have a folder of their own in it, viewer-NAME. A folder with an id is another run's record.
Found look_into(const std::string& directory, Logs logs) {
  Found out;
  look_everywhere(directory, "", logs, out);
  std::error_code error;
  for (fs::directory_iterator entry(directory, error), end; !error && entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (!is_folder(entry->path()) || !name.starts_with("viewer-") || !folder_id(entry->path()).empty()) continue;
    Found inner;
    look_everywhere(directory, name + "/", logs, inner);
    for (auto [from, to] :
         {std::pair{&inner.files, &out.files}, {&inner.folders, &out.folders}, {&inner.links, &out.links}})
      to->insert(to->end(), from->begin(), from->end());
    if (!inner.folders.empty()) out.folders.push_back(name);
  }
  std::sort(out.files.begin(), out.files.end());
  return out;
}

// Writes "summary.json, frames.csv and 12 more".
std::string list_of(const std::vector<std::string>& files) {
  constexpr size_t kNamed = 3;
  std::string out;
  for (size_t i = 0; i < std::min(files.size(), kNamed); ++i) out += (i ? ", " : "") + files[i];
  return files.size() > kNamed ? out + fmt::format(" and {} more", files.size() - kNamed) : out;
}

// A folder of an earlier version has no id, but has the first files of a master.
bool is_record(const std::string& directory, const Found& found) {
  const auto has = [&](const char* name) {
    return std::find(found.files.begin(), found.files.end(), name) != found.files.end();
  };
  return !folder_id(directory).empty() || (has("frames.csv") && has("tiles.csv") && has("trace.json"));
}

void remove_found(const std::string& directory, const Found& found) {
  std::error_code error;
  for (const auto& file : found.files) fs::remove(directory + "/" + file, error);
  for (const auto& folder : found.folders) fs::remove(directory + "/" + folder, error);  // empty ones only
}

// Moves the files, and run.id, from one folder into another of the same file system.
Status move_record(const std::string& from, const std::string& to, const Found& found) {
  std::error_code error;
  auto files = found.files;
  files.emplace_back(kIdFile);
  for (const auto& file : files) {
    const fs::path source = fs::path(from) / file, target = fs::path(to) / file;
    if (!fs::exists(fs::symlink_status(source, error))) continue;  // records of earlier versions have no id
    error = make_private_folder(target.parent_path());
    if (!error) fs::rename(source, target, error);
    if (error) return Error{fmt::format("{}: cannot be moved to {}: {}", source.string(), to, error.message())};
  }
  for (const auto& folder : found.folders) fs::remove(from + "/" + folder, error);  // empty ones only
  return ok_status();
}

// Sets the record aside, and replaces the one that a killed run may have left there.
Status set_aside(const std::string& directory, const Found& found) {
  const std::string aside = directory + "/" + kReplaced;
  std::error_code error;
  if (fs::is_symlink(fs::symlink_status(aside, error))) return Error{aside + ": is a symbolic link; remove it"};
  forget_replaced(directory);
  if (const Status s = move_record(directory, aside, found); !s) {
    (void)move_record(aside, directory, look_into(aside, Logs::kOurs));
    return s;
  }
  return ok_status();
}

std::string new_id() { return fmt::format("{:016x}", random_bits()); }

}  // namespace

std::vector<std::string> recorded_files(const std::string& directory, Logs logs) {
  return look_into(directory, logs).files;
}

std::string folder_id(const std::string& directory) {
  const std::string path = directory + "/" + kIdFile;
  std::error_code error;
  if (fs::symlink_status(path, error).type() != fs::file_type::regular) return {};
  const auto text = read_whole(path, kMostIdBytes);
  const std::string line = text ? text->substr(0, text->find('\n')) : std::string();
  return line.starts_with(kIdWord) ? line.substr(kIdWord.size(), 64) : std::string();
}

bool may_go_on(const std::string& directory) {
  std::error_code error;
  return !folder_id(directory).empty() &&
         fs::symlink_status(directory + "/" + kLivesFile, error).type() == fs::file_type::regular;
}

Result<std::string> go_on_in_folder(const std::string& directory) {
  if (const Status s = refuse_links(directory, Logs::kOthers); !s) return s.error();
  std::error_code error;
  fs::remove(directory + "/summary.json", error);  // it no longer describes the whole record
  return folder_id(directory);
}

Status refuse_links(const std::string& directory, Logs logs) {
  const Found found = look_into(directory, logs);
  if (found.links.empty()) return ok_status();
  return Error{
      fmt::format("{}/{}: is a symbolic link, which a run would write through; remove it, or give another "
                  "--out",
                  directory, found.links.front())};
}

Status refuse_strangers(const std::string& directory, Logs logs) {
  std::error_code error;
  std::vector<std::string> strangers;
  for (const auto& entry : fs::directory_iterator(directory, error)) {
    const std::string name = entry.path().filename().string();
    const bool log = logs == Logs::kOthers && (name == "logs" || name.ends_with(".log"));
    if (!log && !(is_folder(entry.path()) && fs::is_empty(entry.path(), error))) strangers.push_back(name);
  }
  if (strangers.empty() || !folder_id(directory).empty()) return ok_status();
  std::sort(strangers.begin(), strangers.end());
  return Error{
      fmt::format("{}: is not empty and holds no run, but {}; give another --out", directory, list_of(strangers))};
}

Result<std::string> begin_folder(const std::string& directory, bool overwrite, Logs logs) {
  std::error_code error = make_private_folder(directory);
  if (error) return Error{fmt::format("{}: cannot be made a run folder: {}", directory, error.message())};
  if (const Status s = refuse_links(directory, logs); !s) return s.error();
  const Found found = look_into(directory, logs);
  if (found.files.empty())
    if (const Status s = refuse_strangers(directory, logs); !s) return s.error();
  if (!found.files.empty() && !overwrite)
    return Error{fmt::format("{}: holds a record already ({}); give another --out, or --overwrite to replace it",
                             directory, list_of(found.files))};
  if (!found.files.empty() && !is_record(directory, found))
    return Error{fmt::format("{}: holds {}, but is no run's record, so nothing of it is removed; give another --out",
                             directory, list_of(found.files))};
  if (!found.files.empty())
    if (const Status s = set_aside(directory, found); !s) return s.error();
  const std::string path = directory + "/" + kIdFile, id = new_id();
  if (fs::is_symlink(fs::symlink_status(path, error))) return Error{path + ": is a symbolic link; remove it"};
  if (const Status s = write_whole(path, fmt::format("{}{}\n", kIdWord, id)); !s) return s.error();
  return id;
}

void forget_replaced(const std::string& directory) {
  const std::string aside = directory + "/" + kReplaced;
  std::error_code error;
  if (!is_folder(aside)) return;
  remove_found(aside, look_into(aside, Logs::kOurs));
  fs::remove(aside + "/" + kIdFile, error);
  fs::remove(aside, error);
}

void remove_record(const std::string& directory, bool folder_too) {
  std::error_code error;
  if (folder_id(directory).empty()) return;
  remove_found(directory, look_into(directory, Logs::kOurs));
  fs::remove(directory + "/" + kIdFile, error);
  const std::string aside = directory + "/" + kReplaced;
  if (is_folder(aside)) {
    if (const Status s = move_record(aside, directory, look_into(aside, Logs::kOurs)); !s)
      log::warn("{}", s.error().text);
    fs::remove(aside, error);
  }
  if (folder_too) fs::remove(directory, error);
}

void point_latest(const std::string& directory) {
  std::error_code error;
  const fs::path folder = fs::canonical(directory, error);
  if (error || folder.parent_path().filename() != "runs" || folder.filename() == kLatest) return;
  const fs::path link = folder.parent_path() / kLatest;
  const auto before = fs::symlink_status(link, error).type();
  if (before != fs::file_type::not_found && before != fs::file_type::symlink) return;
  const fs::path part = folder.parent_path() / fmt::format(".latest-{}", getpid());
  fs::remove(part, error);
  fs::create_directory_symlink(folder.filename(), part, error);
  if (!error) fs::rename(part, link, error);
  if (error) fs::remove(part, error);
}

}  // namespace telesplat::metrics
