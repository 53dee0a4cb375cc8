#include "client/viewer/received.h"

#include "client/viewer/pictures/received_pictures.h"
#include "client/viewer/points/received_points.h"
#include "client/viewer/slices/received_slices.h"

namespace telesplat::viewer {

std::shared_ptr<Received> make_received(scene::Pipeline pipeline, const ReceivedOptions& options,
                                        const ReceivedLinks& links) {
  if (pipeline == scene::Pipeline::kSlices) return std::make_shared<ReceivedSlices>(options, links);
  if (pipeline == scene::Pipeline::kPictures) return std::make_shared<ReceivedPictures>(links);
  return std::make_shared<ReceivedPoints>(options, links);
}

}  // namespace telesplat::viewer
