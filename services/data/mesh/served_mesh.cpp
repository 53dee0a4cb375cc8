#include "services/data/mesh/served_mesh.h"

#include <fmt/format.h>

#include <filesystem>

#include "common/net/dispatch.h"

namespace telesplat::data {
namespace {

class ServedMesh final : public Served {
 public:
  ServedMesh(std::shared_ptr<const MeshStore> store, std::string title)
      : store_(std::move(store)), title_(std::move(title)) {}

  scene::Kind kind() const override { return scene::Kind::kMesh; }
  std::string title() const override { return title_; }
  std::string summary() const override {
    const MeshStoreInfo& info = store_->info();
    return fmt::format(
        "{} triangles in {} chunks{}{}", info.triangles, store_->chunks().size(),
        info.degenerate_dropped ? fmt::format(", {} degenerate ones dropped", info.degenerate_dropped) : "",
        info.from_cache ? " (from the chunk store)" : "");
  }
  void describe(wire::Hello& hello) const override {
    const MeshStoreInfo& info = store_->info();
    hello.facts.insert({{"format", info.format},
                        {"primitives", std::to_string(info.triangles)},
                        {"triangles", std::to_string(info.triangles)},
                        {"vertices", std::to_string(info.vertices)},
                        {"degenerate_dropped", std::to_string(info.degenerate_dropped)},
                        {"up", info.up},
                        {"from_cache", info.from_cache ? "true" : "false"},
                        {"content_hash", fmt::format("{:016x}", info.content_hash)}});
    hello.box_room = info.box_room;
  }
  Requests requests() const override { return {"chunks", 4096}; }

  void answer(const net::Message& message, const Outlets& outlets) override {
    net::dispatch<wire::ChunkListRequest, wire::ChunkRequest>(
        outlets.requests, message, [&](const auto& request) { outlets.requests.send(reply(request), message.peer); });
  }

 private:
  wire::ChunkList reply(const wire::ChunkListRequest& request) const { return {request.epoch, store_->chunks()}; }
  // Without bytes: there is no such chunk.
  wire::Chunk reply(const wire::ChunkRequest& request) const {
    const bool exists = request.chunk.value < store_->chunks().size();
    return {request.epoch, request.chunk, exists ? store_->chunk(request.chunk).bytes : wire::Bytes{}};
  }

  const std::shared_ptr<const MeshStore> store_;
  const std::string title_;
};

}  // namespace

std::unique_ptr<Served> serve_mesh(std::shared_ptr<const MeshStore> store, const std::string& path) {
  return std::make_unique<ServedMesh>(std::move(store), std::filesystem::path(path).filename().string());
}

}  // namespace telesplat::data
