#include "tools/lab/simulation/excuses.h"

#include <algorithm>

namespace telesplat::simulation {
namespace {

// For so long an event keeps the session busy.
double lasts_s(const Scenario& s, const Event& e) {
  using enum Fault;
  const Fault f = e.fault;
  if (f == kOrder || f == kIntruder) return 0;
  if (f == kSlowLink || f == kSlowWork || f == kKillAtMessage)
    return std::max(0.0, s.duration_s - s.calm_s - e.at_s) + kRecovers_s;
  const bool lasts =
      f == kStop || f == kSilence || f == kIsolate || f == kKill || f == kDiskFull || f == kClockStep || f == kShow;
  return (lasts ? e.amount : 0) + kRecovers_s;
}

// The number of the sampler whose work this event holds up, and nothing else; -1: it holds up others.
int sampler_of(const Event& e) {
  switch (e.fault) {
    case Fault::kBreak:
    case Fault::kSilence:
      return e.a.role == Role::kSampler ? e.a.number : -1;
    case Fault::kKill:
    case Fault::kTerminate:
    case Fault::kStop:
    case Fault::kIsolate:
    case Fault::kClockStep:
    case Fault::kSlowWork:
    case Fault::kKillAtMessage:
    case Fault::kLeave:
      return e.a.role == Role::kSampler ? e.a.number : -1;
    default:
      return -1;
  }
}

// True if a sampler works from before the event until the event is over.
bool has_another(const Scenario& s, const Event& event) {
  const auto touches = [&](int sampler) {
    return std::any_of(s.events.begin(), s.events.end(), [&](const Event& e) {
      if (sampler_of(e) != sampler) return false;
      const bool lasts = e.fault == Fault::kLeave || e.at_s + lasts_s(s, e) >= event.at_s;
      return lasts && e.at_s <= event.at_s + lasts_s(s, event);
    });
  };
  for (int n = 0; n < s.samplers; ++n)
    if (n != sampler_of(event) && !touches(n)) return true;
  return false;
}

bool has_any(const std::vector<Event>& events, const Scenario& s, double from_s, double until_s) {
  return std::any_of(events.begin(), events.end(),
                     [&](const Event& e) { return e.at_s <= until_s && e.at_s + lasts_s(s, e) >= from_s; });
}

}  // namespace

Excuses::Excuses(const Scenario& scenario) : scenario_(scenario) {
  for (const Event& e : scenario.events)
    (sampler_of(e) >= 0 && has_another(scenario, e) ? delays_ : excuses_).push_back(e);
}

bool Excuses::disturbed(double from_s, double until_s) const { return has_any(excuses_, scenario_, from_s, until_s); }

bool Excuses::delayed(double from_s, double until_s) const { return has_any(delays_, scenario_, from_s, until_s); }

bool Excuses::changes_show(double now_s) const {
  return std::any_of(excuses_.begin(), excuses_.end(), [&](const Event& e) {
    return e.fault == Fault::kShow && e.at_s <= now_s && now_s <= e.at_s + lasts_s(scenario_, e);
  });
}

bool Excuses::has(std::initializer_list<Fault> faults) const {
  return std::any_of(scenario_.events.begin(), scenario_.events.end(),
                     [&](const Event& e) { return std::find(faults.begin(), faults.end(), e.fault) != faults.end(); });
}

}  // namespace telesplat::simulation
