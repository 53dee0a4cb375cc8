#include "tools/telesplat/run/pipeline.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>

#include "common/core/clock.h"
#include "common/net/connections/greeting.h"
#include "common/net/service.h"
#include "tools/telesplat/run/wall.h"

namespace telesplat::launcher {
namespace {

constexpr double kMasterPatience_s = 10, kRelayPatience_s = 5, kAskEvery_s = 0.1;
// Time from the start of a wall's viewers to the beginning of their trajectory: for joining and receiving their first
// view.
constexpr double kWallLead_s = 1.5;
constexpr int kServersNice = 10;  // servers must not take the processor from a display

}  // namespace

Pipeline::Pipeline(const RunOptions& options, ProcessGroup group) : options_(options), group_(std::move(group)) {}

Result<Pipeline> Pipeline::start(const RunOptions& o) {
  Pipeline p(o, ProcessGroup(o.log_directory.empty() ? o.out + "/logs" : o.log_directory, o.log_level));
  if (const Status s = p.group_.use_keys(o.keys); !s) return s.error();
  if (!o.join_master.empty())
    p.group_.join(o.join_master);
  else if (const Status s = p.start_servers(); !s)
    return s.error();
  if (o.viewer.wall.name.empty())
    if (const Status s = p.start_viewers(0); !s) return s.error();
  return p;
}

Status Pipeline::start_servers() {
  const RunOptions& o = options_;
  if (const Status s = group_.start_master(master_arguments(o), kMasterPatience_s); !s) return s;
  // Without a loopback device the other processes would ask for ever.
  if (const Status s = net::check_loopback(); !s)
    return Error{
        fmt::format("the session's master cannot be reached at {}: {}; is the loopback device up (ip link set "
                    "lo up)?",
                    group_.endpoint(), s.error().text)};
  if (const Status s = start_data(); !s) return s;
  // A headset's frames come first; in a window new views are worth a little delay of frames.
  Member packer{.role = "packer",
                .name = "packer",
                .arguments = packer_arguments(o),
                .nice = o.viewer.xr.on ? kServersNice : kServersNice / 2};
  if (const Status s = group_.start(std::move(packer)); !s) return s;
  while (last_sampler_ < o.samplers)
    if (const Status s = start_sampler(++last_sampler_); !s) return s;
  return ok_status();
}

Status Pipeline::start_sampler(int number) {
  Member sampler{.role = "sampler",
                 .name = fmt::format("sampler-{}", number),
                 .arguments = sampler_arguments(options_),
                 .nice = kServersNice};
  for (const auto place : {links::Place::kSampler, links::Place::kData})
    if (const Status s = put_link(place, place == links::Place::kData ? "data" : sampler.name, sampler); !s) return s;
  return group_.start(std::move(sampler));
}

// A sampler that is asked to finish hands back its leases; it is not started again.
Status Pipeline::set_samplers(int count) {
  if (!options_.join_master.empty()) return Error{"samplers: the session is another's, and so are its samplers"};
  std::vector<Member*> here;
  for (Member& m : group_.members())
    if (m.role == "sampler" && m.process && !m.given_up) here.push_back(&m);
  options_.samplers = count;
  for (; int(here.size()) > count; here.pop_back()) {
    here.back()->given_up = true;
    here.back()->process->signal(SIGTERM);
  }
  for (int n = int(here.size()); n < count; ++n)
    if (const Status s = start_sampler(++last_sampler_); !s) return s;
  return ok_status();
}

// Starts no server if there is no data set yet.
Status Pipeline::start_data() {
  const RunOptions& o = options_;
  // As the packer: a store that is being made is worth a little delay of frames.
  const int nice = o.viewer.xr.on ? kServersNice : kServersNice / 2;
  for (int i = 0; i < o.data_servers && !o.data.scene.empty(); ++i) {
    const std::string name = o.data_servers == 1 ? "data" : fmt::format("data-{}", i + 1);
    if (const Status s = group_.start({.role = "data", .name = name, .arguments = data_arguments(o, i), .nice = nice});
        !s)
      return s;
  }
  return ok_status();
}

Status Pipeline::open(const RunOptions& options, bool goes_back) {
  group_.end("data");
  before_.reset();
  if (goes_back) before_ = options_.data;
  chosen_ = true;
  progress_.clear();
  options_.data = options.data;
  options_.data_servers = options.data_servers;
  return start_data();
}

// Collects record failures: from a process' own message, or its exit code 1.
void Pipeline::finish() {
  group_.finish();
  for (Member& m : group_.members()) {
    if (!m.process) continue;
    read(m);
    const bool records = m.role == "master" || m.role == "packer";
    if (!m.record_failed.empty())
      record_failures_.push_back(m.record_failed);
    else if (records && m.process->ended() && m.process->exit_code() == 1)
      record_failures_.push_back(fmt::format("{}: not all of the record could be written; {} says: {}", options_.out,
                                             m.name, group_.last_log_line(m.name)));
  }
}

void Pipeline::tell_viewers(const std::string& line) {
  for (Member& m : group_.members())
    if (m.told && m.process) m.process->tell(line);
}

Status Pipeline::put_link(links::Place place, const std::string& name, Member& before) {
  const auto link = options_.links.find(place);
  if (link == options_.links.end()) return ok_status();
  const std::string relay = "link-" + name, text = links::text_of(link->second);
  if (!relays_.contains(relay)) {
    Member member{
        .role = "wan-relay", .name = relay, .arguments = {"--socks", "127.0.0.1:*", "--link", text}, .joins = false};
    const auto listens = group_.start_listener(std::move(member), kRelayPatience_s);
    if (!listens) return listens.error();
    relays_[relay] = *listens;
    // A restarted relay listens at its old address: processes before it know no other.
    group_.find(relay)->arguments[1] = *listens;
  }
  const std::string role = place == links::Place::kData ? "data" : "";
  auto& told = before.arguments;
  told.insert(told.end(), {"--via", role.empty() ? relays_[relay] : role + "=" + relays_[relay]});
  const std::string is = (role.empty() ? "" : "data:") + text;
  const auto flag = std::find(told.begin(), told.end(), "--link");
  if (flag == told.end())
    told.insert(told.end(), {"--link", is});
  else
    *(flag + 1) += " " + is;
  return ok_status();
}

Status Pipeline::start_viewers(double clock_from_s) {
  has_viewers_ = true;
  for (int i = 1; i <= options_.viewers; ++i) {
    // The session that this viewer joins has a viewer-1 already.
    const std::string name = options_.join_master.empty() ? viewer_name(i) : net::unique_name(viewer_name(i));
    Member viewer{.role = "viewer",
                  .name = name,
                  .arguments = viewer_arguments(options_, i, clock_from_s),
                  .told = options_.viewer.window.launched};
    if (const Status s = put_link(links::Place::kViewer, name, viewer); !s) return s;
    if (const Status s = group_.start(std::move(viewer)); !s) return s;
  }
  return ok_status();
}

// The viewers of a wall share a clock, which begins when there is a view to see: so they start once the data servers
// are there.
Status Pipeline::start_wall() {
  const double now = monotonic_s();
  if (!control_) control_ = std::make_unique<ControlClient>(group_.endpoint(), group_.access());
  if (now - asked_s_ > kAskEvery_s) {
    control_->request_status();
    asked_s_ = now;
  }
  const auto status = control_->poll_status();
  if (!status || !status->contains("processes")) return ok_status();
  int there = 0;
  for (const auto& p : (*status)["processes"]) there += p.value("role", "") == "data" && p.value("alive", false);
  if (there < (options_.join_master.empty() ? options_.data_servers : 1)) return ok_status();
  control_.reset();
  return start_viewers(now + kWallLead_s);
}

pid_t Pipeline::display() {
  for (Member& m : group_.members())
    if (m.role == "viewer") return m.process && !m.process->ended() ? m.process->pid() : 0;
  return 0;
}

std::vector<std::string> Pipeline::viewers() {
  std::vector<std::string> out;
  for (const Member& m : group_.members())
    if (m.role == "viewer") out.push_back(m.name);
  return out;
}

Pipeline::State Pipeline::supervise(std::vector<std::string>& news) {
  if (!has_viewers_)
    if (const Status s = start_wall(); !s) {
      news.push_back(s.error().text);
      return State::kFailed;
    }
  group_.limit_logs(monotonic_s());
  int viewing = 0;
  for (Member& m : group_.members()) {
    if (m.role == "viewer" && !m.process->ended()) ++viewing;
    read(m);
    if (m.given_up || !m.process->ended()) continue;
    read(m);  // lines that it printed before it ended
    const State state = m.again_s ? start_again(m, news) : ended(m, news);
    if (state != State::kRunning) return state;
  }
  if (std::exchange(goes_back_, false)) {
    RunOptions back = options_;
    back.data = *before_;
    if (const Status s = open(back); !s) news.push_back(s.error().text);
  }
  if (progress_ != told_progress_) {
    told_progress_ = progress_;
    tell_viewers(progress_.empty() ? "progress" : "progress " + progress_);
  }
  if (viewing > 0 || !has_viewers_) return State::kRunning;
  // Only a master that ends in order completes the record.
  if (Member* master = group_.find("master"); master && master->again_s) {
    master->again_s = 0;
    return start_again(*master, news);
  }
  return State::kFinished;
}

Consequence consequence_of(const Ended& e) {
  const bool viewer = e.role == "viewer", master = e.role == "master";
  // `telesplat ctl stop` ended it: the viewers finish too.
  if (e.code == 0) return master ? Consequence::kFinish : Consequence::kNone;
  if (e.record_failed && e.code == 1) return master ? Consequence::kFinish : Consequence::kNone;  // else all is well
  const bool refused = e.code == 2;
  if (!refused && !viewer && e.restarts < Restarts::kMost) return Consequence::kRestart;
  if (viewer && !refused && e.others) return Consequence::kGiveUp;
  // A window stays, and another data set can be opened in it.
  if (e.role == "data" && e.chosen) return Consequence::kGiveUp;
  return refused ? Consequence::kRefuse : Consequence::kFail;
}

Pipeline::State Pipeline::ended(Member& m, std::vector<std::string>& news) {
  const int code = m.process->exit_code();
  const bool others = m.role == "viewer" && !viewing_beside(m).empty();
  const auto follows =
      consequence_of({m.role, code, m.restarts.lately(monotonic_s()), chosen_, !m.record_failed.empty(), others});
  if (follows == Consequence::kNone) return State::kRunning;
  if (follows == Consequence::kFinish) return State::kFinished;
  if (follows == Consequence::kGiveUp) {
    give_up(m, news);
    return State::kRunning;
  }
  if (follows != Consequence::kRestart) {
    news.push_back(last_words(m));
    return follows == Consequence::kRefuse ? State::kBadInput : State::kFailed;
  }
  const double now_s = monotonic_s();
  m.again_s = m.restarts.died(now_s);
  const std::string when = *m.again_s > now_s ? fmt::format(" in {:.2g} s", *m.again_s - now_s) : "";
  news.push_back(fmt::format("{} died ({} {}); the run goes on, it is started again{}", m.name,
                             code > 128 ? "signal" : "code", code > 128 ? code - 128 : code, when));
  return start_again(m, news);
}

std::string Pipeline::last_words(const Member& m) {
  const int code = m.process->exit_code();
  const std::string last = group_.last_log_line(m.name);
  if (code == 2 && m.role != "viewer") return last;
  return fmt::format("{} ended with code {}{}{}", m.name, code, last.empty() ? "" : ": ", last);
}

std::vector<std::string> Pipeline::viewing_beside(const Member& member) {
  std::vector<std::string> out;
  for (Member& m : group_.members())
    if (m.role == "viewer" && &m != &member && m.process && !m.process->ended()) out.push_back(m.name);
  return out;
}

void Pipeline::give_up(Member& m, std::vector<std::string>& news) {
  m.given_up = true;
  std::string line = last_words(m);
  if (m.role == "viewer") {
    viewer_died_ = true;
    line += fmt::format("; the session goes on for {}", fmt::join(viewing_beside(m), ", "));
  } else {
    progress_.clear();
    goes_back_ = before_.has_value();
  }
  news.push_back(line);
  tell_viewers("problem " + line);
}

Pipeline::State Pipeline::start_again(Member& m, std::vector<std::string>& news) {
  if (monotonic_s() < *m.again_s) return State::kRunning;
  m.again_s.reset();
  // The record belongs to the session, not to one master: the next one continues it.
  auto& told = m.arguments;
  const auto has = [&](const char* flag) { return std::find(told.begin(), told.end(), flag) != told.end(); };
  if (m.role == "master" && has("--out") && !has("--continue")) told.push_back("--continue");
  const Status s = group_.restart(m);
  if (s) return State::kRunning;
  news.push_back(s.error().text);
  return State::kFailed;
}

// Reads "STAGE 0.430".
void Pipeline::read_progress(const std::string& member, const std::string& told) {
  const size_t space = told.rfind(' ');
  if (space == told.npos) return;
  const double fraction = std::atof(told.c_str() + space);
  progress_ = time_left_[member].text(told.substr(0, space), fraction, monotonic_s());
  if (fraction >= 1) progress_.clear();  // later stages report their own progress
}

void Pipeline::read(Member& m) {
  for (const auto& line : m.process->read_lines()) {
    if (line.starts_with("progress ")) read_progress(m.name, line.substr(9));
    if (line.starts_with("record failed ")) m.record_failed = line.substr(14);
    if (line.starts_with("note ")) notes_.push_back(line.substr(5));
    if (line.starts_with("open ") && m.told) wishes_.push_back(line.substr(5));
  }
}

}  // namespace telesplat::launcher
