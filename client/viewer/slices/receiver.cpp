#include "client/viewer/slices/receiver.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "client/viewer/record/slice_record.h"
#include "common/core/clock.h"
#include "common/net/dispatch.h"
#include "common/volume/session.h"

namespace telesplat::viewer {
namespace {

constexpr double kIntroductionPeriod_s = 1, kSilence_s = 2;

geometry::Rect hull(const geometry::Rect& a, const geometry::Rect& b) {
  const int x = std::min(a.x, b.x), y = std::min(a.y, b.y);
  return {x, y, std::max(a.x + a.width, b.x + b.width) - x, std::max(a.y + a.height, b.y + b.height) - y};
}

uint64_t pixels_of(const geometry::Rect& r) { return uint64_t(r.width) * uint64_t(r.height); }

// Pixels that all images have, and the layers that they are merged to.
uint64_t pixels_claimed(std::span<const volume::EncodedSlice> slices, const volume::ShearFrame& shear) {
  uint64_t pixels = 0;
  std::map<int, geometry::Rect> layers;
  for (const auto& slice : slices) {
    const geometry::Rect rect = volume::bounds(slice, shear.width, shear.height);
    pixels += pixels_of(rect);
    const auto [layer, first] = layers.try_emplace(slice.layer, rect);
    if (!first) layer->second = hull(layer->second, rect);
  }
  for (const auto& [layer, rect] : layers) pixels += pixels_of(rect);
  return pixels;
}

}  // namespace

SliceReceiver::SliceReceiver(const Options& options, Links links, SliceCache& cache, metrics::SpanRecorder& spans)
    : options_(options), links_(std::move(links)), cache_(cache), spans_(spans) {}

Status SliceReceiver::set_session(const wire::Welcome& session) {
  const auto read = volume::read_session(session.parameters, session.facts);
  if (!read) return read.error();
  if (const Status s = volume::validate(read->grid); !s) return s;
  grid_ = read->grid;
  master_ = session.master;
  return ok_status();
}

Result<BufferedFrame> SliceReceiver::decode(const wire::SliceFrame& f, const volume::Grid& grid,
                                            std::vector<volume::SliceImage>& images) {
  if (const Status s = geometry::validate(f.camera); !s) return s.error();
  if (const Status s = volume::validate(f.shear, grid); !s) return s.error();
  const std::span bytes(reinterpret_cast<const uint8_t*>(f.data.data()), f.data.size());
  const auto slices = volume::parse_slices(bytes, f.shear.width, f.shear.height, int(f.shear.layers.size()));
  if (!slices) return slices.error();
  if (const uint64_t pixels = pixels_claimed(*slices, f.shear); pixels > kMaxPixels)
    return Error{fmt::format("its images have {} pixels; at most {}", pixels, kMaxPixels)};
  images.resize(slices->size());
  for (size_t i = 0; i < images.size(); ++i)
    if (const Status s = volume::decode_slice_into(images[i], (*slices)[i], f.shear.width, f.shear.height); !s)
      return s.error();
  BufferedFrame out;
  out.frame = std::make_shared<const volume::VolumeFrame>(
      volume::make_volume_frame(grid, f.shear, images, f.frame, f.epoch, f.data.size()));
  out.update = {f.request, f.moments.requested_s, f.camera.pose};
  out.pixels = out.frame->pixels();
  return out;
}

void SliceReceiver::set_buffers(uint64_t buffers) {
  tell_buffers_ |= buffers != options_.buffers;
  options_.buffers = buffers;
}

void SliceReceiver::receive(net::Socket& state, int most) {
  for (int n = 0; n < most; ++n) {
    const auto message = state.receive();
    if (!message) return;
    net::dispatch<wire::SliceFrame>(state, *message,
                                    [&](const wire::SliceFrame& f) { on(f, message->arrived_s, state); });
  }
}

void SliceReceiver::on(const wire::SliceFrame& f, double arrived_s, net::Socket& state) {
  const double begin_s = monotonic_s();
  heard_s_ = begin_s;
  acknowledge_left(state);  // before this one: packers see frames let go in their order
  // What is not put into a buffer has left it.
  const bool again = f.packer == packer_ && f.frame <= newest_;
  if (again || f.viewer != options_.viewer || !grid_ || (options_.buffers > 0 && !links_.expected(f.request)))
    return acknowledge(f.frame, state);
  auto frame = decode(f, *grid_, images_);
  if (!frame) {
    ++decode_errors_;
    if (log_limit_.allow(begin_s)) log::warn("volume frame {}: {}: dropped", f.frame.value, frame.error().text);
    acknowledge(f.frame, state, true);
    return links_.on_lost(f.request);
  }
  packer_ = f.packer;
  newest_ = f.frame;
  if (epoch_.value != 0 && f.epoch != epoch_) links_.on_epoch();
  epoch_ = f.epoch;
  if (const auto requested_s = links_.requested_s(f.request)) frame->update.requested_s = *requested_s;
  frame->source = master_;
  const uint64_t pixels = frame->pixels;
  pixels_received_ += pixels;
  const double decoded_s = monotonic_s();
  spans_.add("decode", links_.to_master_s(begin_s), links_.to_master_s(decoded_s), 1,
             {.frame = double(f.frame.value), .request = double(f.request.value)});
  cache_.put(std::move(*frame));
  if (options_.record) options_.record->add(*grid_, f);  // after it: it is shown first
  if (options_.buffers == 0) acknowledge(f.frame, state);
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

void SliceReceiver::acknowledge(FrameId frame, net::Socket& state, bool damaged) {
  const bool in_order = options_.buffers > 0;
  if (frame.value != 0) acknowledged_ = frame;
  state.send(wire::SliceAck{options_.viewer, frame, in_order ? options_.buffers : kAsyncBuffers, in_order, damaged});
}

// Frames that have left their buffers since the last call.
void SliceReceiver::acknowledge_left(net::Socket& state) {
  for (const FrameId frame : cache_.take_left()) acknowledge(frame, state);
}

void SliceReceiver::tick(double now_s, net::Socket& state) {
  acknowledge_left(state);
  cache_.free_dropped();
  // The same acknowledgement once more changes nothing but what it says of the buffers.
  if (std::exchange(tell_buffers_, false)) acknowledge(acknowledged_, state);
  const double period_s = heard_s_ > 0 ? kSilence_s : kIntroductionPeriod_s;
  if (now_s - std::max(heard_s_, introduced_s_) < period_s) return;
  introduced_s_ = now_s;
  acknowledge({}, state);
}

}  // namespace telesplat::viewer
