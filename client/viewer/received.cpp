#include "client/viewer/received.h"

#include <algorithm>

#include "client/viewer/pictures/received_pictures.h"
#include "client/viewer/points/received_points.h"
#include "client/viewer/slices/received_slices.h"
#include "common/core/log.h"
#include "common/scene/session.h"

namespace telesplat::viewer {

bool Feeds::connect(std::span<const Feed> wanted, const wire::Welcome& session) {
  const scene::SessionView view(session);
  const auto is_there = [&](const Feed& feed) { return !view.endpoint(feed.endpoint).empty(); };
  if (!std::all_of(wanted.begin(), wanted.end(), is_there)) return false;
  const auto is_open = [&](const Feed& feed) {
    return std::any_of(open_.begin(), open_.end(), [&](const Open& o) {
      return o.endpoint == feed.endpoint && o.address == view.endpoint(feed.endpoint);
    });
  };
  if (open_.size() == wanted.size() && std::all_of(wanted.begin(), wanted.end(), is_open)) return false;

  open_.clear();
  const net::SocketOptions bulk{.high_water_mark = 4096,
                                .max_message_bytes = wire::kMaxBulkBytes + wire::kMaxControlBytes,
                                .patience_s = net::kBulkPatience_s,
                                .read_ahead = true};
  for (const Feed& feed : wanted) {
    open_.push_back({feed.endpoint, view.endpoint(feed.endpoint),
                     net::Socket(context_, feed.kind, viewer_ + ":" + feed.endpoint, bulk)});
    if (const Status s = open_.back().socket.connect(open_.back().address); !s) log::error("{}", s.error().text);
  }
  return true;
}

net::Socket* Feeds::find(std::string_view endpoint) {
  for (Open& open : open_)
    if (open.endpoint == endpoint) return &open.socket;
  return nullptr;
}

void Feeds::add_to(std::vector<net::Socket*>& sockets) {
  for (Open& open : open_) sockets.push_back(&open.socket);
}

uint64_t Feeds::rejected() const {
  uint64_t out = 0;
  for (const Open& open : open_) out += open.socket.rejected();
  return out;
}

std::shared_ptr<Received> make_received(scene::Pipeline pipeline, const ReceivedOptions& options,
                                        const ReceivedLinks& links) {
  if (pipeline == scene::Pipeline::kSlices) return std::make_shared<ReceivedSlices>(options, links);
  if (pipeline == scene::Pipeline::kPictures) return std::make_shared<ReceivedPictures>(links);
  return std::make_shared<ReceivedPoints>(options, links);
}

}  // namespace telesplat::viewer
