#include "client/viewer/slices/received_slices.h"

#include <algorithm>
#include <utility>

#include "client/viewer/record/slice_record.h"
#include "common/core/clock.h"
#include "common/net/dispatch.h"
#include "common/volume/session.h"

namespace telesplat::viewer {
namespace {

constexpr double kSliceIntroduction_s = 1, kSilence_s = 2;
constexpr Feed kSliceFeeds[] = {{net::Kind::kDealer, "state"}};

}  // namespace

ReceivedSlices::ReceivedSlices(const ReceivedOptions& options, const ReceivedLinks& links)
    : links_(links),
      buffers_(uint64_t(links.gate.buffers())),
      record_(options.slices),
      cache_(links.gate.waits(), options.in_step) {}

Status ReceivedSlices::follow(const wire::Welcome& session) {
  const auto read = volume::read_session(session.parameters, session.facts);
  if (!read) return read.error();
  if (const Status s = volume::validate(read->grid); !s) return s;
  grid_ = read->grid;
  master_ = session.master;
  return ok_status();
}

std::span<const Feed> ReceivedSlices::feeds() const { return kSliceFeeds; }

void ReceivedSlices::receive(int most) {
  net::Socket& state = *links_.feeds.find("state");
  for (int n = 0; n < most; ++n) {
    const auto message = state.receive();
    if (!message) return;
    net::dispatch<wire::SliceFrame>(state, *message,
                                    [&](const wire::SliceFrame& f) { on(f, message->arrived_s, state); });
  }
}

void ReceivedSlices::on(const wire::SliceFrame& f, double arrived_s, net::Socket& state) {
  const double begin_s = monotonic_s();
  heard_s_ = begin_s;
  acknowledge_left(state);  // before this one: the packer must see frames leave their buffers in order
  // A frame that is not put into a buffer counts as having left it.
  const bool again = f.packer == packer_ && f.frame <= newest_;
  // A link or another process may repeat a request.
  const bool overtaken = buffers_ == 0 && f.request.value > 0 && f.request < newest_request_;
  if (again || overtaken || f.viewer != links_.viewer || !grid_ ||
      (buffers_ > 0 && !links_.gate.with([&](Coupling& c) { return c.is_open(f.request); })))
    return acknowledge(f.frame, state);
  auto frame = decode_frame(f, *grid_, images_);
  if (!frame) {
    ++decode_errors_;
    if (log_limit_.allow(begin_s)) log::warn("volume frame {}: {}: dropped", f.frame.value, frame.error().text);
    acknowledge(f.frame, state, true);
    return links_.on_lost(f.request);
  }
  packer_ = f.packer;
  newest_ = f.frame;
  newest_request_ = std::max(newest_request_, f.request);
  if (epoch_.value != 0 && f.epoch != epoch_) links_.on_epoch();
  epoch_ = f.epoch;
  if (const auto requested_s = links_.requested_s(f.request)) frame->update.requested_s = *requested_s;
  frame->source = master_;
  const uint64_t pixels = frame->pixels;
  const double decoded_s = monotonic_s();
  links_.spans.add("decode", links_.to_master_s(begin_s), links_.to_master_s(decoded_s), 1,
                   {.frame = double(f.frame.value), .request = double(f.request.value)});
  cache_.put(std::move(*frame));
  if (record_) record_->add(*grid_, f);  // the record comes last: the frame is shown first
  if (buffers_ == 0) acknowledge(f.frame, state);
  // The packer sends frames in order: earlier requests get no answer.
  links_.gate.with([&](Coupling& c) { c.skip_before(f.request); });
  links_.on_part({.viewer = f.viewer,
                  .request = f.request,
                  .epoch = f.epoch,
                  .frame = f.frame,
                  .complete = true,
                  .tiles = std::max<uint64_t>(f.slabs, 1),
                  .points = pixels,
                  .samples = f.voxels,
                  .bytes = f.data.size(),
                  .camera = f.camera,
                  .moments = f.moments,
                  .arrived_s = links_.to_master_s(arrived_s),
                  .decode_begin_s = links_.to_master_s(begin_s),
                  .decoded_s = links_.to_master_s(decoded_s)});
}

void ReceivedSlices::acknowledge(FrameId frame, net::Socket& state, bool damaged) {
  const bool in_order = buffers_ > 0;
  if (frame.value != 0) acknowledged_ = frame;
  state.send(wire::SliceAck{links_.viewer, frame, in_order ? buffers_ : kAsyncBuffers, in_order, damaged});
}

// Acknowledges the frames that have left their buffers since the last call.
void ReceivedSlices::acknowledge_left(net::Socket& state) {
  for (const FrameId frame : cache_.take_left()) acknowledge(frame, state);
}

void ReceivedSlices::tick(double now_s) {
  net::Socket& state = *links_.feeds.find("state");
  acknowledge_left(state);
  cache_.free_dropped();
  // Repeats the last acknowledgement: only its number of buffers is new.
  if (std::exchange(tell_buffers_, false)) acknowledge(acknowledged_, state);
  const double period_s = heard_s_ > 0 ? kSilence_s : kSliceIntroduction_s;
  if (now_s - std::max(heard_s_, introduced_s_) < period_s) return;
  introduced_s_ = now_s;
  acknowledge({}, state);
}

void ReceivedSlices::on_coupling(int buffers) {
  cache_.set_in_order(buffers > 0);
  tell_buffers_ |= uint64_t(buffers) != buffers_;
  buffers_ = uint64_t(buffers);
}

wire::ShownState ReceivedSlices::newest_state() const {
  const auto [source, frame, held] = cache_.newest();
  return {source, frame.value, 0, held};
}

void ReceivedSlices::show_state(const wire::ShownState& state) { cache_.show_until(state.source, {state.newest}); }

void ReceivedSlices::add_status(net::MasterLink::Values& values) const {
  values["pixels"] = double(cache_.figures().pixels);
  values["messages_rejected"] += double(decode_errors_);
}

Result<std::unique_ptr<ViewSource>> ReceivedSlices::make_source(const DisplayOptions&, Renderers& renderers) {
  auto renderer = renderers.for_slices();
  if (!renderer) return renderer.error();
  return std::unique_ptr<ViewSource>(new SliceSource(std::move(*renderer), cache_));
}

DrawnFrame SliceSource::draw_views(const FrameInput& input, std::span<const geometry::Camera> cameras,
                                   std::span<const volume::WarpTarget> targets) {
  const BufferedFrame shown = cache_.displayed();
  DrawnFrame out;
  out.empty = shown.frame == nullptr;
  out.chosen_s = monotonic_s();
  if (out.empty && !input.even_empty) return out;
  for (size_t i = 0; i < cameras.size(); ++i) {
    const auto stats = renderer_->render(shown.frame.get(), cameras[i], input.look.background, targets[i]);
    out.stats.resolve_ms += stats.warp_cpu_ms;
    out.drawn += stats.samples;
    out.items += stats.images;
  }
  out.selected = out.cached = shown.pixels;
  if (out.empty) return out;
  out.sequence = shown.frame->frame.value;
  out.epoch = shown.frame->epoch;
  out.update = shown.update;
  return out;
}

DrawnFrame SliceSource::draw(const FrameInput& input, image::View& view) {
  const volume::WarpTarget target{view.width, view.height, view.colour.data(),
                                  input.with_depth ? view.depth_m.data() : nullptr};
  return draw_views(input, {&input.camera, 1}, {&target, 1});
}

DrawnFrame SliceSource::draw_pair(const FrameInput& input, const std::array<geometry::Camera, 2>& eyes,
                                  const std::array<splat::FrameTarget, 2>& targets) {
  std::array<volume::WarpTarget, 2> both;
  for (size_t i = 0; i < 2; ++i) both[i] = {targets[i].width, targets[i].height, targets[i].colour, targets[i].depth_m};
  return draw_views(input, eyes, both);
}

std::optional<Pick> SliceSource::pick(const geometry::Camera& camera, double x_pix, double y_pix, double opacity) {
  const BufferedFrame shown = cache_.displayed();
  if (!shown.frame) return std::nullopt;
  return pick_volume(*shown.frame, camera, x_pix, y_pix, opacity);
}

}  // namespace telesplat::viewer
