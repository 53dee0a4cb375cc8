#include "tools/telesplat/run/joined/joined_session.h"

#include <fmt/format.h>

#include <filesystem>
#include <utility>

#include "common/core/utf8.h"
#include "tools/telesplat/control/json_fields.h"

namespace telesplat::launcher {
namespace {

constexpr double kMasterSilence_s = 3;  // a master that is asked twice a second is silent after this

// A session's name for a data set is its file's name, with its ending or without.
bool is_called(const std::string& shown, const std::string& named) {
  const std::string file = std::filesystem::path(named).filename();
  return named == shown || file == shown || file.starts_with(shown + ".");
}

}  // namespace

JoinedSession::JoinedSession(std::string master, std::string named)
    : master_(std::move(master)), named_(std::move(named)), host_(master_) {}

std::string JoinedSession::awaited(bool nobody_there, const std::string& refusal, double now_s) {
  if (heard_s_ && now_s - *heard_s_ < kMasterSilence_s) return net::lacking_text(lacks_);
  if (!refusal.empty()) return refusal;
  if (!nobody_there) return "no master answers at " + master_;
  host_.begin();
  const std::string problem = host_.problem();
  return fmt::format("no master is at {}{}{}", master_, problem.empty() ? "" : ": ", problem);
}

std::vector<std::string> JoinedSession::look(const nlohmann::json* status, bool nobody_there,
                                             const std::string& refusal, double now_s) {
  std::vector<std::string> out;
  if (status) {
    heard_s_ = now_s;
    lacks_ = text(*status, "lacks");
    const auto* session = field(*status, "session");
    const std::string shown = session ? text(*session, "scene") : std::string();
    if (!named_.empty() && !shown.empty()) {
      if (!is_called(shown, named_))
        out.push_back(fmt::format("{} is not opened: the session shows {}", named_, printable(shown)));
      named_.clear();
    }
  }
  if (auto line = waiting_.look(awaited(nobody_there, refusal, now_s), now_s)) out.push_back(*std::move(line));
  return out;
}

}  // namespace telesplat::launcher
