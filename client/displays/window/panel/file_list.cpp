#include "client/displays/window/panel/file_list.h"

#include <algorithm>
#include <filesystem>
#include <mutex>
#include <thread>
#include <tuple>

#include "client/viewer/recent_files.h"
#include "common/core/guarded.h"

namespace telesplat::viewer {

namespace fs = std::filesystem;

// If a file system blocks a thread, the thread is abandoned: it keeps only this object alive.
struct FileList::Shared {
  std::mutex mutex;
  uint64_t asked = 0, read = 0;
  std::shared_ptr<const Listing> listing;
};

FileList::Listing read_folder(const std::string& folder) {
  FileList::Listing out;
  std::error_code error;
  out.folder = fs::absolute(folder.empty() ? "." : folder, error).lexically_normal().string();
  if (out.folder.size() > 1 && out.folder.back() == '/') out.folder.pop_back();
  fs::directory_iterator at(out.folder, error);
  if (error) {
    out.problem = out.folder + ": " + error.message();
    return out;
  }
  for (const fs::directory_iterator end; !error && at != end; at.increment(error)) {
    const std::string name = at->path().filename();
    if (name.empty() || name.front() == '.') continue;
    if (out.entries.size() == FileList::kMost) {
      out.whole = false;
      break;
    }
    std::error_code unknown;
    const bool is_folder = at->is_directory(unknown);
    const auto bytes = is_folder ? 0 : at->file_size(unknown);
    out.entries.push_back({name, is_folder, unknown ? 0 : uint64_t(bytes)});
  }
  std::sort(out.entries.begin(), out.entries.end(),
            [](const auto& a, const auto& b) { return std::tuple(!a.folder, a.name) < std::tuple(!b.folder, b.name); });
  out.recent = read_recent(recent_files_path());
  return out;
}

void FileList::go(const std::string& folder) {
  if (!shared_) shared_ = std::make_shared<Shared>();
  uint64_t number = 0;
  {
    const std::lock_guard lock(shared_->mutex);
    number = ++shared_->asked;
  }
  std::thread([shared = shared_, folder, number] {
    std::shared_ptr<const Listing> listing;
    const Status read =
        guarded("reading a folder", [&] { listing = std::make_shared<const Listing>(read_folder(folder)); });
    if (!read) listing = std::make_shared<const Listing>(Listing{.folder = folder, .problem = read.error().text});
    const std::lock_guard lock(shared->mutex);
    if (number < shared->read) return;  // a later listing is there already
    shared->read = number;
    shared->listing = std::move(listing);
  }).detach();
}

std::shared_ptr<const FileList::Listing> FileList::listing() const {
  if (!shared_) return nullptr;
  const std::lock_guard lock(shared_->mutex);
  return shared_->listing;
}

bool FileList::busy() const {
  if (!shared_) return false;
  const std::lock_guard lock(shared_->mutex);
  return shared_->read < shared_->asked;
}

}  // namespace telesplat::viewer
