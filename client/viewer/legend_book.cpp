#include "client/viewer/legend_book.h"

#include <algorithm>

#include "common/scene/legend.h"

namespace telesplat::viewer {
namespace {

constexpr size_t kMostPages = 64;  // older epochs are not on display any more

}  // namespace

void LegendBook::follow(const wire::Welcome& session) {
  std::string told;
  for (const char* name : {scene::kColouringFact, "transfer", "kind"})
    if (const auto found = session.facts.find(name); found != session.facts.end()) told += found->second + '\n';
  const std::lock_guard lock(mutex_);
  const Page* before = pages_.empty() ? nullptr : &pages_.back();
  if (before && before->told == told && before->epoch <= session.epoch) return;
  // A new master counts epochs anew: pages of this epoch and later ones go.
  while (!pages_.empty() && pages_.back().epoch >= session.epoch) pages_.pop_back();
  const auto legend = scene::legend_of(session.facts, session.parameters);
  pages_.push_back({session.epoch, told, legend ? std::make_shared<const image::Legend>(*legend) : nullptr});
  if (pages_.size() > kMostPages) pages_.pop_front();
}

std::shared_ptr<const image::Legend> LegendBook::at(EpochId epoch) const {
  const std::lock_guard lock(mutex_);
  const auto after = std::find_if(pages_.begin(), pages_.end(), [&](const Page& p) { return p.epoch > epoch; });
  return after == pages_.begin() ? nullptr : std::prev(after)->legend;
}

}  // namespace telesplat::viewer
