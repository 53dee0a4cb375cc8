#include "tools/lab/simulation/session.h"

#include <sys/resource.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "common/core/check.h"
#include "common/net/keys/roles.h"
#include "common/scene/session.h"
#include "tools/lab/simulation/peers.h"

namespace telesplat::simulation {
namespace {

constexpr double kTurn_s = 40e-6, kPacks_s = 300e-6;  // what a turn takes, and what packing a tile does
constexpr double kRestart_s = 0.3;
constexpr double kBootTime_s = 1000;

net::Role key_of(Role role) { return net::role_named(kRoleNames[size_t(role)]).value_or(net::Role::kServer); }

}  // namespace

Session::Session(const Scenario& scenario, std::vector<Observer*> observers, std::string folder)
    : scenario_(scenario),
      show_(scenario.show),
      observers_(std::move(observers)),
      folder_(std::move(folder)),
      dice_(scenario.seed ^ 0x73657373),
      network_(scenario.seed ^ 0x6e6574),
      heard_(std::make_unique<Heard>()) {
  enter_world(this);
  network_.on_passed = [this](const Passed& m) { passed(m); };
  network_.on_ready = [this](int number) {
    for (auto& p : processes_)
      if (p->number == number) p->ready = true;
  };
  network_.ahead_s = [this] { return spent_s_; };
  network_.on_rejected = [this](int number, std::string_view socket, const net::Message& m, const std::string& why) {
    for (Observer* o : observers_) o->on_rejected(part_of(number), socket, m, why);
  };
  network_.set_links(scenario_.links);
  add({Role::kMaster, 0}, 0);
  for (int n = 0; n < scenario_.data_servers; ++n) add({Role::kData, n}, dice_.between(0, 0.5));
  add({Role::kPacker, 0}, dice_.between(0, 0.5));
  for (int n = 0; n < scenario_.samplers; ++n) add({Role::kSampler, n}, dice_.between(0, 0.5));
  for (int n = 0; n < scenario_.viewers; ++n) add({Role::kViewer, n}, dice_.between(0, 0.8));
}

Session::~Session() {
  for (auto& p : processes_)
    if (p->program) kill(*p, "the simulation ends");
  peers_.clear();
  enter_world(nullptr);
}

// ---- time -----------------------------------------------------------------------------------------------------------

double Session::clock_of(const Process& p, double network_s) const {
  return kBootTime_s + p.offset_s + network_s * (1 + p.drift);
}
double Session::monotonic_s() { return current_ ? clock_of(*current_, now_s_ + spent_s_) : now_s_; }
double Session::thread_cpu_s() { return current_ ? current_->cpu_s + spent_s_ : 0; }
const std::string& Session::clock_id() {
  static const std::string none;
  return current_ ? current_->clock : none;
}
uint64_t Session::process_id() { return current_ ? uint64_t(current_->number) + 1 : 1; }
bool Session::stop_requested() { return current_ && current_->told_to_stop; }

void Session::run_as(Process& p, const std::function<void()>& what) {
  Process* const before = std::exchange(current_, &p);
  const double spent_before_s = std::exchange(spent_s_, 0);
  what();
  p.cpu_s += spent_s_;
  p.busy_until_s = std::max(p.busy_until_s, now_s_ + spent_s_);
  current_ = before, spent_s_ = spent_before_s;
}

// ---- processes ------------------------------------------------------------------------------------------------------

Session::Process& Session::process(Part part) {
  for (auto& p : processes_)
    if (p->part == part) return *p;
  CHECK(false);
}

void Session::add(Part part, double starts_s) {
  auto p = std::make_unique<Process>();
  p->part = part;
  p->name = text_of(part);
  p->clock = scenario_.one_machine ? "machine" : p->name;
  if (!scenario_.one_machine) p->offset_s = dice_.between(0, 1e5), p->drift = dice_.between(-60e-6, 60e-6);
  p->starts_s = starts_s;
  if (part.role == Role::kViewer)
    heads_[part.number] =
        size_t(part.number) < scenario_.heads.size()
            ? scenario_.heads[size_t(part.number)]
            : draw_head(scenario_.seed + uint64_t(part.number), scenario_.duration_s - scenario_.calm_s);
  processes_.push_back(std::move(p));
}

void Session::begin(Process& p) {
  const bool first = p.number < 0;
  p.starts_s.reset();
  p.number = int(lives_.size());
  lives_.push_back(p.part);
  p.stopped = p.told_to_stop = p.ready = false;
  ProcessOptions options;
  options.clock = [this, &p](double network_s) { return clock_of(p, network_s); };
  options.run = [this, &p, number = p.number](const std::function<void()>& what) {
    if (p.number == number && p.program) run_as(p, what);
  };
  const Role key_role = p.key_of.value_or(p.part.role);
  if (p.key_of ? key_role != Role::kMaster : scenario_.keys) options.key = Identity{p.name, key_of(key_role)};
  p.context = std::make_unique<net::Context>(network_.attach(p.number, std::move(options)));
  link(p);
  for (Observer* o : observers_) o->on_begin(p.part, p.number, now_s_);
  run_as(p, [&] {
    auto made = make_program(p.part.role, *p.context,
                             {.scenario = scenario_,
                              .show = show_,
                              .number = p.part.number,
                              .name = p.name,
                              .folder = folder_,
                              .first = first,
                              .spend = [this](double s) { spend(s); },
                              .slowness = [&p] { return p.slowness; }});
    if (made) {
      p.program = *std::move(made);
    } else if (!disk_free_s_) {  // with a full disk a master with a record cannot begin
      for (Observer* o : observers_) o->on_unexpected(p.part, made.error().text, now_s_);
    }
  });
  if (!p.program) {
    p.context.reset();
    p.starts_s = now_s_ + kRestart_s;
    return;
  }
  p.wake_s = p.busy_until_s = p.next_frame_s = now_s_;
}

// Messages to and from viewers go over their links.
void Session::link(Process& p) {
  for (const auto& other : processes_) {
    if (other->number < 0 || other.get() == &p) continue;
    const bool far = (p.part.role == Role::kViewer) != (other->part.role == Role::kViewer);
    network_.set_link(p.number, other->number, far ? scenario_.to_viewers : scenario_.links);
    network_.set_link(other->number, p.number, far ? scenario_.to_viewers : scenario_.links);
  }
}

void Session::kill(Process& p, const std::string& how) {
  network_.crash(p.number);
  run_as(p, [&] { p.program.reset(); });
  p.context.reset();
  p.stopped = false;
  p.killed_after.reset();
  for (Observer* o : observers_) o->on_end(p.part, p.number, now_s_, how);
}

// Its sockets close in an orderly way: what waits to be sent leaves within their linger.
void Session::ended(Process& p) {
  const int code = p.program->exit_code();
  run_as(p, [&] {
    if (const Status s = p.program->finish(); !s && !disk_was_full_)
      for (Observer* o : observers_) o->on_unexpected(p.part, s.error().text, now_s_);
    p.program.reset();
    p.context.reset();
  });
  for (Observer* o : observers_) {
    o->on_end(p.part, p.number, now_s_, "ended");
    if (code != 0 && !p.key_of) o->on_unexpected(p.part, "exit code " + std::to_string(code), now_s_);
  }
  p.gone = p.gone || p.key_of;
  if (!p.gone && !ends_ && !p.starts_s) p.starts_s = now_s_ + kRestart_s;
}

void Session::take_turn(Process& p) {
  ++turns_;
  p.ready = false;
  std::optional<net::Wait> wait;
  run_as(p, [&] { wait = p.program->turns().turn(); });
  if (p.dies) return;
  p.busy_until_s = std::max(p.busy_until_s, now_s_) + kTurn_s;
  if (!wait) return ended(p);
  p.wait = *std::move(wait);
  p.wake_s = p.busy_until_s + p.wait.for_s;
  p.ready = p.ready || (!p.wait.sockets.empty() && net::wait_readable(p.wait.sockets, 0));
}

void Session::display(Process& p) {
  p.next_frame_s += 1 / scenario_.display_hz;
  SimulatedViewer& v = *p.program->viewer();
  const double busy_until_s = p.busy_until_s;
  run_as(p, [&] {
    if (const auto drawn = v.frame(head(p.part.number))) {
      ++frames_;
      for (Observer* o : observers_) o->on_frame(p.part, v, *drawn, now_s_);
    }
  });
  p.busy_until_s = busy_until_s;  // another thread
  if (v.over()) p.ready = true;
}

geometry::Pose Session::head(int viewer) const { return heads_.at(viewer).at(now_s_); }

SimulatedViewer* Session::viewer(int number) {
  for (auto& p : processes_)
    if (p->part == Part{Role::kViewer, number}) return p->program ? p->program->viewer() : nullptr;
  return nullptr;
}
bool Session::runs(Part part) const {
  return std::any_of(processes_.begin(), processes_.end(),
                     [&](const auto& p) { return p->part == part && p->program && !p->stopped; });
}
int Session::count(Role role) const {
  return int(std::count_if(processes_.begin(), processes_.end(),
                           [&](const auto& p) { return p->part.role == role && !p->gone && !p->key_of; }));
}

// ---- the loop -------------------------------------------------------------------------------------------------------

double Session::due_s(const Process& p) const {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  if (p.starts_s) return std::max(*p.starts_s, now_s_);
  if (!p.program) return kNever;
  if (p.stopped) return p.goes_on_s.value_or(kNever);
  double out = std::max(p.busy_until_s, p.ready ? now_s_ : p.wake_s);
  if (p.part.role == Role::kViewer) out = std::min(out, p.next_frame_s);
  return std::max(out, now_s_);
}

void Session::run_until(double until_s) {
  while (!stopped_) {
    for (auto& p : processes_)
      if (std::exchange(p->dies, false) && p->program) {
        kill(*p, "killed at a message");
        p->starts_s = now_s_ + kRestart_s;
      }
    double next_s = network_.next_s();
    if (next_event_ < scenario_.events.size()) next_s = std::min(next_s, scenario_.events[next_event_].at_s);
    if (disk_free_s_) next_s = std::min(next_s, *disk_free_s_);
    if (!calm_) next_s = std::min(next_s, scenario_.duration_s - scenario_.calm_s);
    Process* first = nullptr;
    double first_s = std::numeric_limits<double>::infinity();
    for (auto& p : processes_)
      if (const double due = due_s(*p); due < first_s) first = p.get(), first_s = due;
    next_s = std::max(now_s_, std::min(next_s, first_s));
    if (next_s > until_s) break;
    now_s_ = next_s;
    const bool arrived = network_.next_s() <= now_s_;
    network_.advance(now_s_);
    if (arrived) continue;
    if (!calm_ && now_s_ >= scenario_.duration_s - scenario_.calm_s) begin_calm();
    if (disk_free_s_ && *disk_free_s_ <= now_s_) fill_disk(0);
    if (next_event_ < scenario_.events.size() && scenario_.events[next_event_].at_s <= now_s_) {
      apply(scenario_.events[next_event_++]);
      continue;
    }
    if (!first || first_s > now_s_) continue;
    Process& p = *first;
    if (p.starts_s) {
      begin(p);
    } else if (p.stopped) {
      p.stopped = false, p.goes_on_s.reset();
      network_.go_on(p.number);
      p.next_frame_s = std::max(p.next_frame_s, now_s_);
    } else if (p.part.role == Role::kViewer && p.next_frame_s <= now_s_) {
      display(p);
    } else {
      take_turn(p);
    }
  }
  if (!stopped_) now_s_ = std::max(now_s_, until_s), network_.advance(now_s_);
}

void Session::end() {
  ends_ = true;
  Process& master = process({Role::kMaster, 0});
  master.told_to_stop = true;
  for (const double until_s = now_s_ + 8; now_s_ < until_s && !stopped_;) {
    if (std::none_of(processes_.begin(), processes_.end(), [](const auto& p) { return p->program != nullptr; })) return;
    run_until(now_s_ + 0.05);
  }
  for (const auto& p : processes_)
    if (p->program)
      for (Observer* o : observers_) o->on_unexpected(p->part, "it does not end with its session", now_s_);
}

// ---- what goes wrong ------------------------------------------------------------------------------------------------

void Session::passed(const Passed& m) {
  if (m.what == Passed::What::kSent && current_) {
    if (current_->killed_after && --*current_->killed_after <= 0) {
      current_->killed_after.reset();
      current_->dies = true;
      network_.crash(current_->number);
      return;
    }
    if (m.type == wire::TileDone::kName) spend(kPacks_s);
    const bool sampled =
        m.type == wire::SliceImages::kName || (m.type == wire::DepthTile::kName && show_ == Show::kJulia);
    if (sampled) spend(scenario_.tile_s * current_->slowness);
  }
  heard_->listen(m);
  for (Observer* o : observers_) o->on_passed(m);
}

void Session::begin_calm() {
  calm_ = true;
  if (disk_free_s_) fill_disk(0);
  for (auto& p : processes_) {
    p->slowness = 1;
    p->killed_after.reset();
    if (p->stopped) p->goes_on_s = now_s_;
    if (p->starts_s) p->starts_s = std::min(*p->starts_s, now_s_ + kRestart_s);
    if (p->program) link(*p);
  }
}

void Session::apply(const Event& e) {
  for (Observer* o : observers_) o->on_event(e);
  const auto found = std::find_if(processes_.begin(), processes_.end(), [&](const auto& p) { return p->part == e.a; });
  Process* const a = found == processes_.end() ? nullptr : found->get();
  const bool runs = a && a->program;
  using enum Fault;
  const Fault f = e.fault;
  if (f == kKill && runs) kill(*a, "killed"), a->starts_s = now_s_ + e.amount;
  if (f == kTerminate && runs) a->told_to_stop = a->ready = true;
  if (f == kKillAtMessage && runs) a->killed_after = e.amount;
  if (f == kStop && runs && !a->stopped) network_.stop(a->number), a->stopped = true, a->goes_on_s = now_s_ + e.amount;
  if (f == kClockStep)
    for (auto& p : processes_)
      if (p.get() == a || scenario_.one_machine) p->offset_s += e.amount;
  if (f == kSlowWork && a) a->slowness = e.amount;
  if (f == kDiskFull) fill_disk(e.amount);
  if (f == kLeave) leave(e.a);
  if (f == kJoin) join(e.a.role);
  if (f == kIntruder) join(e.a.role, e.b.role);
  if (f == kShow) change_show(e);
  if (f == kStranger || f == kImpostor || f == kOrder) speak(e);
  if (f == kBreak || f == kSilence || f == kIsolate || f == kSlowLink) trouble_links(e);
}

void Session::trouble_links(const Event& e) {
  const auto number_of = [&](Part part) {
    for (const auto& p : processes_)
      if (p->part == part && p->program) return p->number;
    return -1;
  };
  const int a = number_of(e.a), b = number_of(e.b);
  if (a < 0) return;
  if (e.fault == Fault::kBreak && b >= 0 && a != b) network_.break_connections(a, b);
  if (e.fault == Fault::kSilence && b >= 0 && a != b) network_.silence(a, b, e.amount);
  for (const auto& p : processes_) {
    if (!p->program || p->number == a) continue;
    if (e.fault == Fault::kIsolate) network_.silence(a, p->number, e.amount);
    if (e.fault != Fault::kSlowLink) continue;
    LinkOptions slow = scenario_.to_viewers;
    slow.bytes_s = e.amount;
    network_.set_link(p->number, a, slow);
  }
}

void Session::leave(Part part) {
  for (auto& p : processes_)
    if (p->part == part && !p->gone && count(part.role) > 1) {
      p->gone = true;
      p->starts_s.reset();
      if (p->program) p->told_to_stop = p->ready = true;
      if (p->program && part.role == Role::kViewer) kill(*p, "left");
    }
}

void Session::join(Role role, std::optional<Role> key_of) {
  const auto is_one = [&](const auto& p) {
    return p->part.role == role && p->key_of.has_value() == key_of.has_value();
  };
  const int number = int(std::count_if(processes_.begin(), processes_.end(), is_one));
  if (number >= 6 || (key_of == Role::kMaster && !scenario_.keys)) return;
  add({role, key_of ? kFirstIntruder + number : number}, now_s_);
  processes_.back()->key_of = key_of;
}

void Session::change_show(const Event& e) {
  show_ = e.show;
  for (auto& p : processes_) {
    if (p->part.role != Role::kData || p->key_of) continue;
    if (p->program) kill(*p, "killed");
    p->starts_s = now_s_ + e.amount;
  }
}

// Files cannot grow while the disk is full; the process that simulates must be of its own.
void Session::fill_disk(double for_s) {
  if (folder_.empty()) return;
  disk_was_full_ = true;
  rlimit limit{};
  getrlimit(RLIMIT_FSIZE, &limit);
  limit.rlim_cur = for_s > 0 ? 1 : limit.rlim_max;
  setrlimit(RLIMIT_FSIZE, &limit);
  disk_free_s_ = for_s > 0 ? std::optional(now_s_ + for_s) : std::nullopt;
}

void Session::speak(const Event& e) {
  const int number = int(lives_.size());
  peers_.push_back(std::make_unique<Peer>(network_, number, scenario_.keys, e));
  lives_.push_back({Role::kMaster, -1});
  for (const auto& p : processes_) {
    if (p->number < 0) continue;
    network_.set_link(p->number, number, scenario_.to_viewers);
    network_.set_link(number, p->number, scenario_.to_viewers);
  }
  peers_.back()->speak(e, text_of(Part{e.b.role, 0}), *heard_, dice_);
}

}  // namespace telesplat::simulation
