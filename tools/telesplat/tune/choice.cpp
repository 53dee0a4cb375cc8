#include "tools/telesplat/tune/choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/core/check.h"
#include "tools/telesplat/tune/candidates.h"

namespace telesplat::launcher {
namespace {

struct Guard {
  double TuneFigures::*figure;
  const char* title;
  bool more_is_better, in_db;
  double least, most;  // tolerated: never less, never more; a share, or dB
};
constexpr Guard kGuards[] = {{&TuneFigures::latency_ms, "latency", false, false, 0.01, 0.05},
                             {&TuneFigures::psnr_db, "PSNR", true, true, 0.1, 0.5},
                             {&TuneFigures::age_ms, "age of the displayed update", false, false, 0.02, 0.05},
                             {&TuneFigures::frame_ms, "time between frames", false, false, 0.01, 0.05}};
constexpr size_t kGains = 2;  // the first so many can make a configuration better

// How much better b is than the defaults a (negative: worse), round by round: a machine that becomes slower does so for
// both.
struct Difference {
  double gain = 0;   // median over the rounds that have both
  double apart = 0;  // mean distance of the rounds from it
  double least = 0;  // the worst round
  size_t rounds = 0;
};
std::optional<Difference> difference(const Guard& g, const Measured& a, const Measured& b) {
  std::vector<double> gains;
  for (size_t i = 0; i < std::min(a.runs.size(), b.runs.size()); ++i) {
    const double x = a.runs[i].*g.figure, y = b.runs[i].*g.figure;
    const double unit = g.in_db ? 1 : x;
    if (std::isfinite(x) && std::isfinite(y) && unit > 0) gains.push_back((g.more_is_better ? y - x : x - y) / unit);
  }
  if (gains.empty()) return std::nullopt;
  const Spread s = spread_of(gains);
  double apart = 0;
  for (const double gain : gains) apart += std::abs(gain - s.median) / static_cast<double>(gains.size());
  return Difference{s.median, apart, s.least, gains.size()};
}

bool came_to_its_end(const TuneFigures& run) { return run.updates_per_s >= 0; }

std::string amount(const Guard& g, double share) {
  return g.in_db ? fmt::format("{:.2f} dB", share) : fmt::format("{:.1f} %", 100 * share);
}

struct Judged {
  bool allowed = true, better = false, maybe = false;
  bool clearly = false;  // not allowed, and worse by more than rounds differ
  std::string reason;
};

Judged judge(const Measured& defaults, const Measured& m) {
  Judged out;
  if (std::none_of(m.runs.begin(), m.runs.end(), came_to_its_end))
    return {.allowed = false, .clearly = true, .reason = "no run of it came to its end"};
  for (size_t i = 0; i < defaults.runs.size(); ++i)
    if (came_to_its_end(defaults.runs[i]) && !(i < m.runs.size() && came_to_its_end(m.runs[i])))
      return {.allowed = false,
              .clearly = true,
              .reason = fmt::format("its run in round {} did not come to its end", i + 1)};
  if (spread_of(m, &TuneFigures::latency_ms).runs == 0)
    return {.allowed = false, .clearly = true, .reason = "no view update was complete"};
  std::vector<std::string> gains;
  for (const Guard& g : kGuards) {
    const auto d = difference(g, defaults, m);
    if (!d && spread_of(defaults, g.figure).runs > 0) {
      out.allowed = false;
      out.reason = fmt::format("{} was measured in no round of both", g.title);
      return out;
    }
    if (!d) continue;
    const double tolerated = std::clamp(d->apart, g.least, g.most);
    if (-d->gain > tolerated) {
      out.allowed = false;
      out.clearly = -d->gain > d->apart;
      out.reason =
          fmt::format("{} is worse by {}, and {} is tolerated", g.title, amount(g, -d->gain), amount(g, tolerated));
      return out;
    }
    if (&g >= kGuards + kGains || d->gain <= g.least) continue;
    if (d->least > 0 && d->rounds > 1) {
      out.better = true;
      gains.push_back(fmt::format("{} is better by {}, in each of {} rounds", g.title, amount(g, d->gain), d->rounds));
    } else {
      out.maybe = true;
    }
  }
  out.reason = out.better  ? fmt::format("{}", fmt::join(gains, "; "))
               : out.maybe ? "what it seems to gain it does not gain in every round"
                           : "it gains nothing";
  return out;
}

double median_or(const Measured& m, double TuneFigures::*figure, double otherwise) {
  const Spread s = spread_of(m, figure);
  return s.runs > 0 ? s.median : otherwise;
}

double measured_score(const Measured& defaults, const Measured& m) {
  const double psnr = spread_of(m, &TuneFigures::psnr_db).runs > 0 ? median_or(defaults, &TuneFigures::psnr_db, 0) : 0;
  return score(median_or(m, &TuneFigures::latency_ms, 0), median_or(m, &TuneFigures::psnr_db, psnr),
               median_or(defaults, &TuneFigures::latency_ms, 0), psnr);
}

bool noisy(const Measured& defaults, const Measured& m) {
  const auto d = difference(kGuards[0], defaults, m);
  return d && d->apart > kQuiet;
}

}  // namespace

TuneFigures tune_figures(const Figures& summary) {
  const auto value = [&](const char* name) {
    const double* found = find(summary, name);
    return found ? *found : std::numeric_limits<double>::quiet_NaN();
  };
  return {value("view_update_latency_ms.median"), value("update_age_ms.median"), value("quality.psnr_db.median"),
          value("inter_frame_delay_ms.median"), value("updates_per_s")};
}

Spread spread_of(const Measured& measured, double TuneFigures::*figure) {
  std::vector<double> values;
  for (const TuneFigures& run : measured.runs)
    if (std::isfinite(run.*figure)) values.push_back(run.*figure);
  return values.empty() ? Spread{} : spread_of(values);
}

Choice choose(const std::vector<Measured>& all) {
  CHECK(!all.empty() && !all[0].runs.empty());
  Choice out;
  out.reasons.emplace_back("the defaults");
  bool maybe = false, open = false, loud = false;
  double best = 0;
  for (size_t i = 1; i < all.size(); ++i) {
    const Judged judged = judge(all[0], all[i]);
    out.reasons.push_back(judged.reason);
    maybe = maybe || (judged.allowed && judged.maybe);
    open = open || !judged.clearly;
    loud = loud || noisy(all[0], all[i]);
    if (!judged.allowed || !judged.better) continue;
    const double gain = measured_score(all[0], all[i]);
    if (gain <= best) continue;
    best = gain;
    out.chosen = i;
  }
  if (out.chosen != 0) {
    out.verdict = Verdict::kBetter;
    out.sentence = fmt::format("{} is better than the defaults: {}", all[out.chosen].name, out.reasons[out.chosen]);
  } else if (loud && open) {
    out.verdict = Verdict::kTooNoisy;
    out.sentence = fmt::format(
        "the machine was too noisy to tell: from round to round the differences in latency vary by more than {:.0f} %; "
        "the defaults stay",
        100 * kQuiet);
  } else if (all.size() == 1) {
    out.sentence = "the defaults stay: the model knows of nothing that could be better, so that nothing else was run";
  } else {
    out.sentence = maybe ? "the defaults stay: nothing gains in every round" : "the defaults were best";
  }
  return out;
}

}  // namespace telesplat::launcher
