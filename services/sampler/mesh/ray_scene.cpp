#include "services/sampler/mesh/ray_scene.h"

#include <fmt/format.h>

#include <optional>

#include "common/core/log.h"
#include "common/parallel/in_parallel.h"

namespace telesplat::sampler {

RayScene::RayScene(int threads)
    : arena_(threads > 0 ? threads : tbb::task_arena::automatic), device_(rtcNewDevice(nullptr)) {
  CHECK(device_ != nullptr);
  rtcSetDeviceErrorFunction(
      device_.get(), [](void*, RTCError code, const char* text) { log::error("Embree error {}: {}", int(code), text); },
      nullptr);
  top_.reset(rtcNewScene(device_.get()));
}

Result<RayScene::Slot> RayScene::build(ChunkId id, std::span<const std::byte> coded) const {
  auto held = hold(id, coded);
  if (!held) return held.error();
  Slot slot{std::move(*held), Scene(rtcNewScene(device_.get()))};
  const geometry::MeshChunkView& view = slot.held.view;
  RTCGeometry mesh = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, view.positions_room.data(), 0, 12,
                             view.vertices());
  rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, view.indices.data(), 0, 12,
                             view.triangles());
  // A third of the time, and rays take a tenth longer: chunks come and go, and few rays are cast at each.
  rtcSetGeometryBuildQuality(mesh, RTC_BUILD_QUALITY_LOW);
  rtcSetSceneBuildQuality(slot.scene.get(), RTC_BUILD_QUALITY_LOW);
  rtcCommitGeometry(mesh);
  rtcAttachGeometry(slot.scene.get(), mesh);
  rtcReleaseGeometry(mesh);
  rtcCommitScene(slot.scene.get());
  if (const RTCError error = rtcGetDeviceError(device_.get()); error != RTC_ERROR_NONE)
    return Error{
        fmt::format("chunk {} of {} triangles refused: Embree error {}", id.value, view.triangles(), int(error))};
  return slot;
}

void RayScene::install(ChunkId id, Slot slot) {
  remove(id);
  if (free_.empty()) {
    free_.push_back(static_cast<unsigned>(slots_.size()));
    slots_.emplace_back();
  }
  const unsigned at = free_.back();
  free_.pop_back();
  RTCGeometry instance = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(instance, slot.scene.get());
  rtcCommitGeometry(instance);
  rtcAttachGeometryByID(top_.get(), instance, at);
  rtcReleaseGeometry(instance);
  slots_[at] = std::move(slot);
  slot_of_[id] = at;
  changed_ = true;
}

Status RayScene::add(std::vector<std::pair<ChunkId, geometry::ChunkBytes>> chunks) {
  std::vector<std::optional<Result<Slot>>> built(chunks.size());
  arena_.execute([&] {
    in_parallel(size_t{0}, chunks.size(),
                [&](size_t i) { built[i].emplace(build(chunks[i].first, chunks[i].second.bytes)); });
  });
  Refusals refusals(chunks.size());
  for (size_t i = 0; i < chunks.size(); ++i) {
    if (built[i]->ok())
      install(chunks[i].first, std::move(**built[i]));
    else
      refusals.add(built[i]->error());
  }
  return refusals.status();
}

Result<std::function<void()>> RayScene::prepare(ChunkId id, std::span<const std::byte> coded) {
  auto built = build(id, coded);
  if (!built) return built.error();
  const auto slot = std::make_shared<Slot>(std::move(*built));
  return std::function<void()>([this, id, slot] { install(id, std::move(*slot)); });
}

void RayScene::remove(ChunkId id) {
  const auto found = slot_of_.find(id);
  if (found == slot_of_.end()) return;
  rtcDetachGeometry(top_.get(), found->second);
  slots_[found->second] = {};
  free_.push_back(found->second);
  slot_of_.erase(found);
  changed_ = true;
}

void RayScene::show(const std::vector<ChunkId>& chunks) {
  std::vector<bool> wanted(slots_.size());
  for (const ChunkId id : chunks)
    if (const auto found = slot_of_.find(id); found != slot_of_.end()) wanted[found->second] = true;
  for (const auto& [id, at] : slot_of_) {
    if (slots_[at].shown == wanted[at]) continue;
    const RTCGeometry instance = rtcGetGeometry(top_.get(), at);
    wanted[at] ? rtcEnableGeometry(instance) : rtcDisableGeometry(instance);
    slots_[at].shown = wanted[at];
    changed_ = true;
  }
}

void RayScene::commit() {
  if (!changed_) return;
  arena_.execute([&] { rtcCommitScene(top_.get()); });
  changed_ = false;
}

}  // namespace telesplat::sampler
