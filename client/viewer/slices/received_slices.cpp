#include "client/viewer/slices/received_slices.h"

#include "client/viewer/slices/source.h"

namespace telesplat::viewer {
namespace {

constexpr Feed kFeeds[] = {{net::Kind::kDealer, "state"}};

}  // namespace

ReceivedSlices::ReceivedSlices(const ReceivedOptions& options, const ReceivedLinks& links)
    : links_(links),
      cache_(links.gate.waits(), options.in_step),
      receiver_({links.viewer, uint64_t(links.gate.buffers()), options.slices},
                {links.requested_s,
                 [this](RequestId r) { return links_.gate.with([r](Coupling& c) { return c.is_open(r); }); },
                 [this](const ViewPart& part) {
                   // The packer sends frames in order.
                   links_.gate.with([&](Coupling& c) { c.skip_before(part.request); });
                   links_.on_part(part);
                 },
                 links.on_lost, links.on_epoch, links.to_master_s},
                cache_, links.spans) {}

std::span<const Feed> ReceivedSlices::feeds() const { return kFeeds; }

void ReceivedSlices::receive(int most) { receiver_.receive(*links_.feeds.find("state"), most); }

void ReceivedSlices::tick(double now_s) { receiver_.tick(now_s, *links_.feeds.find("state")); }

void ReceivedSlices::on_coupling(int buffers) {
  cache_.set_in_order(buffers > 0);
  receiver_.set_buffers(uint64_t(buffers));
}

wire::ShownState ReceivedSlices::newest_state() const {
  const auto [source, frame, held] = cache_.newest();
  return {source, frame.value, 0, held};
}

void ReceivedSlices::show_state(const wire::ShownState& state) { cache_.show_until(state.source, {state.newest}); }

void ReceivedSlices::add_status(net::MasterLink::Values& values) const {
  values["pixels"] = double(cache_.figures().pixels);
  values["messages_rejected"] += double(receiver_.figures().decode_errors);
}

Result<std::unique_ptr<ViewSource>> ReceivedSlices::make_source(const DisplayOptions&, Renderers& renderers) {
  auto renderer = renderers.for_slices();
  if (!renderer) return renderer.error();
  return std::unique_ptr<ViewSource>(new SliceSource(std::move(*renderer), cache_));
}

}  // namespace telesplat::viewer
