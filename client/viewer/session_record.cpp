#include "client/viewer/session_record.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <vector>

#include "common/core/log.h"
#include "common/core/whole_file.h"
#include "common/metrics/run_folder.h"
#include "common/scene/session.h"

namespace telesplat::viewer {
namespace {

namespace fs = std::filesystem;

constexpr int kMostViewers = 100;  // viewers of one name in a session's folder

// True if this process made the folder: if several try, one succeeds.
bool made(const std::string& folder) { return mkdir(folder.c_str(), 0700) == 0; }

// The folder's name came over the network: links in it must not lead elsewhere.
Status refuse_links(const std::string& folder) {
  std::error_code error;
  for (const char* name : {"/images", "/spool", "/points.events", "/slices.events"})
    if (fs::is_symlink(fs::symlink_status(folder + name, error)))
      return Error{fmt::format("{}{}: is a symbolic link", folder, name)};
  return ok_status();
}

// Turns a viewer's name into the name of its folder.
std::string folder_name(const std::string& name) {
  std::string out;
  for (const char c : name) out += std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_' ? c : '-';
  return out.starts_with("viewer-") ? out : "viewer-" + out;
}

// Checks a folder that the person names: the session's, one in it, or one without a record.
Status check_own(const std::string& directory) {
  std::error_code error;
  const fs::path own = fs::absolute(directory, error).lexically_normal();
  const fs::path named = own.has_filename() ? own : own.parent_path();
  if (!metrics::folder_id(named).empty() || !metrics::folder_id(named.parent_path()).empty()) return ok_status();
  const auto files = metrics::recorded_files(named);
  if (files.empty()) return metrics::refuse_strangers(named, metrics::Logs::kOthers);
  return Error{fmt::format("{}: holds a record already ({}{}); give another --out", directory, files.front(),
                           files.size() > 1 ? ", ..." : "")};
}

}  // namespace

Result<std::unique_ptr<SessionRecord>> SessionRecord::open(const RecordOptions& options) {
  std::unique_ptr<SessionRecord> out(new SessionRecord(options));
  if (options.out.empty()) return out;
  if (const Status s = check_own(options.out); !s) return s.error();
  if (const Status s = out->open_in(options.out); !s) return s.error();
  return out;
}

// A folder with images/ is taken: viewers that join the session later make their own.
Status SessionRecord::open_in(const std::string& directory) {
  if (const auto error = make_private_folder(directory + "/images"))
    return Error{fmt::format("{}/images: cannot be made: {}", directory, error.message())};
  lock_ = Descriptor::open_file(directory + "/images", O_RDONLY | O_DIRECTORY);
  if (!lock_.lock(LOCK_EX | LOCK_NB) && errno == EWOULDBLOCK)  // some file systems know no locks
    return Error{fmt::format("{}: another viewer records there; give another --out", directory)};
  auto spool = FrameSpool::open(directory + "/spool");
  if (!spool) return spool.error();
  if (options_.points_mb > 0) {
    auto events = EventRecorder::open(directory + "/points.events", options_.points_mb << 20);
    if (!events) return events.error();
    events_ = std::move(*events);
    slices_ = std::make_unique<SliceRecorder>(directory + "/slices.events", options_.points_mb << 20);
  }
  spool_ = std::move(*spool);
  directory_ = directory;
  spool_ready_ = spool_.get();
  return ok_status();
}

uint64_t SessionRecord::files_failed() {
  if (events_) events_->flush();
  if (slices_) slices_->flush();
  return uint64_t(spool_ && spool_->failed() > 0) + uint64_t(events_ && events_->failed()) +
         uint64_t(slices_ && slices_->failed());
}

std::string SessionRecord::failure() {
  if (files_failed() == 0) return {};
  std::vector<std::string> what;
  int error = 0;
  const auto look = [&](int e, const std::string& name) {
    if (e == 0) return;
    what.push_back(name);
    if (error == 0) error = e;
  };
  if (spool_) look(spool_->error(), fmt::format("{} pictures", spool_->failed()));
  if (events_) look(events_->error(), "points.events");
  if (slices_) look(slices_->error(), "slices.events");
  return fmt::format("{}: {}", fmt::join(what, ", "), std::strerror(error));
}

void SessionRecord::follow(const wire::Welcome& session) {
  if (std::exchange(known_, true)) return;
  const std::string folder = scene::value_or(session.facts, "run_folder", std::string()),
                    id = scene::value_or(session.facts, "run_id", std::string());
  if (folder.empty() || id.empty()) return;  // the session keeps no record
  std::error_code error;
  if (!options_.out.empty()) {
    const fs::path own = fs::absolute(options_.out, error).lexically_normal();
    const fs::path named = own.has_filename() ? own : own.parent_path();
    if (metrics::folder_id(named) == id)
      records_in_ = std::string(".");
    else if (metrics::folder_id(named.parent_path()) == id)
      records_in_ = named.filename().string();
    return;
  }
  if (!options_.join) return;
  if (metrics::folder_id(folder) != id)
    return log::info("the run's folder {} is not on this machine: --out is needed to keep pictures", folder);
  if (const Status s = join(folder, id); !s) log::warn("no pictures are kept: {}", s.error().text);
}

// The first viewer, which makes images/, records into the folder itself, others into their own folder in it.
Status SessionRecord::join(const std::string& folder, const std::string& id) {
  if (const Status s = refuse_links(folder); !s) return s;
  if (made(folder + "/images")) {
    records_in_ = std::string(".");
    return open_in(folder);
  }
  const std::string name = folder_name(options_.name);
  for (int n = 1; n <= kMostViewers; ++n) {
    const std::string own = n == 1 ? name : fmt::format("{}-{}", name, n);
    if (!made(folder + "/" + own)) continue;
    records_in_ = own;
    log::info("pictures go to {}/{}", folder, own);
    return open_in(folder + "/" + own);
  }
  return Error{fmt::format("{}: no folder {} can be made in it for run {}", folder, name, id)};
}

}  // namespace telesplat::viewer
