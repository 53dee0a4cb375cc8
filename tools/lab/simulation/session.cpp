#include "tools/lab/simulation/session.h"

#include <algorithm>
#include <utility>

#include "common/core/check.h"
#include "common/net/keys/roles.h"
#include "common/scene/session.h"
#include "tools/lab/simulation/peers.h"

namespace telesplat::simulation {
namespace {

constexpr double kPacks_s = 300e-6;  // that packing a tile takes
constexpr double kRestart_s = 0.3;

net::Role key_of(Role role) { return net::role_named(kRoleNames[size_t(role)]).value_or(net::Role::kServer); }

}  // namespace

Session::Session(const Scenario& scenario, std::vector<Observer*> observers, std::string folder)
    : scenario_(scenario),
      show_(scenario.show),
      observers_(std::move(observers)),
      disk_(std::move(folder)),
      dice_(scenario.seed ^ 0x73657373),
      network_(scenario.seed ^ 0x6e6574),
      heard_(std::make_unique<Heard>()) {
  enter_world(this);
  network_.on_passed = [this](const Passed& m) { passed(m); };
  network_.on_ready = [this](int number) {
    for (auto& p : processes_)
      if (p->number == number) p->schedule.ready = true;
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

double Session::monotonic_s() { return current_ ? current_->clock.at(now_s_ + spent_s_) : now_s_; }
double Session::thread_cpu_s() { return current_ ? current_->schedule.cpu_s + spent_s_ : 0; }
const std::string& Session::clock_id() {
  static const std::string none;
  return current_ ? current_->clock.id : none;
}
uint64_t Session::process_id() { return current_ ? uint64_t(current_->number) + 1 : 1; }
bool Session::stop_requested() { return current_ && current_->fate.told_to_stop; }

void Session::run_as(Process& p, const std::function<void()>& what) {
  Process* const before = std::exchange(current_, &p);
  const double spent_before_s = std::exchange(spent_s_, 0);
  what();
  p.schedule.work(now_s_, spent_s_);
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
  p->clock.id = scenario_.one_machine ? "machine" : p->name;
  if (!scenario_.one_machine) p->clock.offset_s = dice_.between(0, 1e5), p->clock.drift = dice_.between(-60e-6, 60e-6);
  p->fate.restart(starts_s);
  if (p->is_viewer())
    heads_[part.number] =
        size_t(part.number) < scenario_.heads.size()
            ? scenario_.heads[size_t(part.number)]
            : draw_head(scenario_.seed + uint64_t(part.number), scenario_.duration_s - scenario_.calm_s);
  processes_.push_back(std::move(p));
}

void Session::begin(Process& p) {
  const bool first = p.number < 0;
  p.fate.starts_s.reset();
  p.number = int(lives_.size());
  lives_.push_back(p.part);
  p.fate.stopped = p.fate.told_to_stop = p.schedule.ready = false;
  ProcessOptions options;
  options.clock = [&p](double network_s) { return p.clock.at(network_s); };
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
                              .folder = disk_.folder(),
                              .first = first,
                              .spend = [this](double s) { spend(s); },
                              .slowness = [&p] { return p.schedule.slowness; }});
    if (made) {
      p.program = *std::move(made);
    } else if (!disk_.is_full()) {  // with a full disk a master with a record cannot begin
      for (Observer* o : observers_) o->on_unexpected(p.part, made.error().text, now_s_);
    }
  });
  if (!p.program) {
    p.context.reset();
    p.fate.restart(now_s_ + kRestart_s);
    return;
  }
  p.schedule.begin(now_s_);
}

// Messages to and from viewers go over their links.
void Session::link(Process& p) {
  for (const auto& other : processes_) {
    if (other->number < 0 || other.get() == &p) continue;
    const bool far = p.is_viewer() != other->is_viewer();
    network_.set_link(p.number, other->number, far ? scenario_.to_viewers : scenario_.links);
    network_.set_link(other->number, p.number, far ? scenario_.to_viewers : scenario_.links);
  }
}

void Session::kill(Process& p, const std::string& how) {
  network_.crash(p.number);
  run_as(p, [&] { p.program.reset(); });
  p.context.reset();
  p.fate.stopped = false;
  p.fate.killed_after.reset();
  for (Observer* o : observers_) o->on_end(p.part, p.number, now_s_, how);
}

// Its sockets close in an orderly way: what waits to be sent leaves within their linger.
void Session::ended(Process& p) {
  const int code = p.program->exit_code();
  run_as(p, [&] {
    if (const Status s = p.program->finish(); !s && !disk_.was_full())
      for (Observer* o : observers_) o->on_unexpected(p.part, s.error().text, now_s_);
    p.program.reset();
    p.context.reset();
  });
  for (Observer* o : observers_) {
    o->on_end(p.part, p.number, now_s_, "ended");
    if (code != 0 && !p.key_of) o->on_unexpected(p.part, "exit code " + std::to_string(code), now_s_);
  }
  p.fate.gone = p.fate.gone || p.key_of;
  if (!p.fate.gone && !ends_ && !p.fate.starts_s) p.fate.restart(now_s_ + kRestart_s);
}

void Session::take_turn(Process& p) {
  ++turns_;
  p.schedule.ready = false;
  std::optional<net::Wait> wait;
  run_as(p, [&] { wait = p.program->turns().turn(); });
  if (p.fate.dies) return;
  if (!wait) return ended(p);
  p.schedule.turned(now_s_, *std::move(wait));
}

void Session::display(Process& p) {
  p.schedule.next_frame_s += 1 / scenario_.display_hz;
  SimulatedViewer& v = *p.program->viewer();
  const double busy_until_s = p.schedule.busy_until_s;
  run_as(p, [&] {
    if (const auto drawn = v.frame(head(p.part.number))) {
      ++frames_;
      for (Observer* o : observers_) o->on_frame(p.part, v, *drawn, now_s_);
    }
  });
  p.schedule.busy_until_s = busy_until_s;  // another thread
  if (v.over()) p.schedule.ready = true;
}

geometry::Pose Session::head(int viewer) const { return heads_.at(viewer).at(now_s_); }

SimulatedViewer* Session::viewer(int number) {
  for (auto& p : processes_)
    if (p->part == Part{Role::kViewer, number}) return p->program ? p->program->viewer() : nullptr;
  return nullptr;
}
bool Session::runs(Part part) const {
  return std::any_of(processes_.begin(), processes_.end(),
                     [&](const auto& p) { return p->part == part && p->program && !p->fate.stopped; });
}
int Session::count(Role role) const {
  return int(std::count_if(processes_.begin(), processes_.end(),
                           [&](const auto& p) { return p->part.role == role && !p->fate.gone && !p->key_of; }));
}

// ---- the loop -------------------------------------------------------------------------------------------------------

void Session::run_until(double until_s) {
  while (!stopped_) {
    for (auto& p : processes_)
      if (std::exchange(p->fate.dies, false) && p->program) {
        kill(*p, "killed at a message");
        p->fate.restart(now_s_ + kRestart_s);
      }
    double next_s = std::min(network_.next_s(), disk_.free_s());
    if (next_event_ < scenario_.events.size()) next_s = std::min(next_s, scenario_.events[next_event_].at_s);
    if (!calm_) next_s = std::min(next_s, scenario_.duration_s - scenario_.calm_s);
    Process* first = nullptr;
    double first_s = kNever_s;
    for (auto& p : processes_)
      if (const double due = p->due_s(now_s_); due < first_s) first = p.get(), first_s = due;
    next_s = std::max(now_s_, std::min(next_s, first_s));
    if (next_s > until_s) break;
    now_s_ = next_s;
    const bool arrived = network_.next_s() <= now_s_;
    network_.advance(now_s_);
    if (arrived) continue;
    if (!calm_ && now_s_ >= scenario_.duration_s - scenario_.calm_s) begin_calm();
    if (disk_.free_s() <= now_s_) disk_.free();
    if (next_event_ < scenario_.events.size() && scenario_.events[next_event_].at_s <= now_s_) {
      apply(scenario_.events[next_event_++]);
      continue;
    }
    if (!first || first_s > now_s_) continue;
    Process& p = *first;
    if (p.fate.starts_s) {
      begin(p);
    } else if (p.fate.stopped) {
      p.fate.go_on();
      network_.go_on(p.number);
      p.schedule.next_frame_s = std::max(p.schedule.next_frame_s, now_s_);
    } else if (p.is_viewer() && p.schedule.next_frame_s <= now_s_) {
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
  master.fate.told_to_stop = true;
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
    if (current_->fate.dies_by_message()) return network_.crash(current_->number);
    if (m.type == wire::TileDone::kName) spend(kPacks_s);
    const bool sampled =
        m.type == wire::SliceImages::kName || (m.type == wire::DepthTile::kName && show_ == Show::kJulia);
    if (sampled) spend(scenario_.tile_s * current_->schedule.slowness);
  }
  heard_->listen(m);
  for (Observer* o : observers_) o->on_passed(m);
}

void Session::begin_calm() {
  calm_ = true;
  if (disk_.is_full()) disk_.free();
  for (auto& p : processes_) {
    p->schedule.slowness = 1;
    p->fate.killed_after.reset();
    if (p->fate.stopped) p->fate.goes_on_s = now_s_;
    if (p->fate.starts_s) p->fate.restart(std::min(*p->fate.starts_s, now_s_ + kRestart_s));
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
  if (f == kKill && runs) kill(*a, "killed"), a->fate.restart(now_s_ + e.amount);
  if (f == kTerminate && runs) a->fate.told_to_stop = a->schedule.ready = true;
  if (f == kKillAtMessage && runs) a->fate.killed_after = e.amount;
  if (f == kStop && runs && !a->fate.stopped) network_.stop(a->number), a->fate.stop(now_s_ + e.amount);
  if (f == kClockStep)
    for (auto& p : processes_)
      if (p.get() == a || scenario_.one_machine) p->clock.offset_s += e.amount;
  if (f == kSlowWork && a) a->schedule.slowness = e.amount;
  if (f == kDiskFull) disk_.fill(now_s_ + e.amount);
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
    if (p->part == part && !p->fate.gone && count(part.role) > 1) {
      p->fate.gone = true;
      p->fate.starts_s.reset();
      if (p->program) p->fate.told_to_stop = p->schedule.ready = true;
      if (p->program && p->is_viewer()) kill(*p, "left");
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
    p->fate.restart(now_s_ + e.amount);
  }
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
