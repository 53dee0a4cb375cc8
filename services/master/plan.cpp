#include "services/master/plan.h"

#include "services/master/slabs/slab_plan.h"
#include "services/master/tiles/tile_plan.h"

namespace telesplat::master {

std::unique_ptr<Plan> make_plan(scene::Pipeline pipeline, const MasterOptions& options, const PlanLinks& links) {
  switch (pipeline) {
    case scene::Pipeline::kPoints:
    case scene::Pipeline::kPictures:
      return std::make_unique<TilePlan>(options, links);
    case scene::Pipeline::kSlices:
      return std::make_unique<SlabPlan>(options, links);
  }
  return nullptr;
}

}  // namespace telesplat::master
