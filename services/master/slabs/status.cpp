// What `telesplat ctl status` tells of a volume.
#include <nlohmann/json.hpp>

#include "services/master/slabs/slab_plan.h"

namespace telesplat::master {
namespace {

using Json = nlohmann::ordered_json;

Json told(const Partition& partition, bool in_use, const PlanLinks& links) {
  Json out{{"number", partition.number},
           {"in_use", in_use},
           {"ready", partition.ready()},
           {"slabs", Json::array()},
           {"spare", Json::array()}};
  for (const Slab& s : partition.slabs)
    out["slabs"].push_back({{"sampler", links.name_of(s.sampler)},
                            {"begin", s.range.begin},
                            {"end", s.range.end},
                            {"weight", s.weight},
                            {"ready", s.ready},
                            {"voxels", s.voxels},
                            {"bytes", s.bytes}});
  for (const auto& id : partition.spare) out["spare"].push_back(links.name_of(id));
  return out;
}

}  // namespace

void SlabPlan::add_status(Json& status) const {
  if (!whole_) return;
  const auto& session = volume_.session();
  Json& out = status["volume"];
  out = {{"transfer", volume::to_text(session.transfer)},
         {"step", session.step},
         {"steps", session.steps},
         {"layers", schedule_.layers()},
         {"bytes_per_voxel", volume_.bytes_per_voxel()},
         {"data_servers", Json::array()},
         {"partitions", partitions_.made()}};
  for (const auto& s : volume_.servers())
    out["data_servers"].push_back({{"name", s.name}, {"begin", s.begin}, {"end", s.end}, {"here", s.here}});
  if (const auto partition = partitions_.newest())
    out["partition"] = told(*partition, partitions_.in_use() == partition, links_);
}

}  // namespace telesplat::master
