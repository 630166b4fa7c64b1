#include "geometry/gltf_io.h"

#include "base/error.h"
#include "base/file.h"
#include "base/scratch_folder.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

class GltfIo : public testing::Test {
  protected:
    ScratchFolder folder_{"gltf"};
    void SetUp() override {
        const float points[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
        const std::uint16_t indices[3] = {0, 1, 2};
        std::string data(reinterpret_cast<const char*>(points), sizeof points);
        data.append(reinterpret_cast<const char*>(indices), sizeof indices);
        write_text_file(folder_ / "t.bin", data);
    }
    std::string text(const std::string& uri = "t.bin", int index_count = 3, int bytes = 42) {
        return fmt::format(
            R"({{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}],
            "nodes": [{{"mesh": 0, "name": "tri", "translation": [1, 2, 3]}}],
            "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "indices": 1,
            "material": 0}}]}}],
            "materials": [{{"name": "glass", "pbrMetallicRoughness": {{"metallicFactor": 0}},
            "extensions": {{"KHR_materials_ior": {{"ior": 1.33}},
            "KHR_materials_transmission": {{"transmissionFactor": 1}},
            "KHR_materials_volume": {{"thicknessFactor": 1, "attenuationDistance": 0.5,
            "attenuationColor": [1, 0.5, 0.25]}}}}}}],
            "buffers": [{{"uri": "{}", "byteLength": {}}}],
            "bufferViews": [{{"buffer": 0, "byteOffset": 0, "byteLength": 36}},
            {{"buffer": 0, "byteOffset": 36, "byteLength": 6}}],
            "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
            "min": [0, 0, 0], "max": [1, 1, 0]}},
            {{"bufferView": 1, "componentType": 5123, "count": {}, "type": "SCALAR"}}]}})",
            uri, bytes, index_count);
    }
};

TEST_F(GltfIo, TurnsUpAndMapsGlass) {
    write_text_file(folder_ / "t.gltf", text());
    const std::vector<GltfPrimitive> primitives = read_gltf(folder_ / "t.gltf");
    ASSERT_EQ(primitives.size(), 1u);
    const Mesh& mesh = primitives[0].mesh;
    EXPECT_LT((mesh.vertices[0] - Vec3f(1, -3, 2)).norm(), 1e-6f);  // y up becomes z up
    EXPECT_LT((mesh.vertices[2] - Vec3f(1, -3, 3)).norm(), 1e-6f);
    const GltfMaterial& material = primitives[0].material;
    EXPECT_DOUBLE_EQ(material.ior, 1.33);
    EXPECT_DOUBLE_EQ(material.transmission, 1.0);
    EXPECT_NEAR(material.sigma_a_per_m[1], std::log(2.0) / 0.5, 1e-5);
    EXPECT_NEAR(material.sigma_a_per_m[0], 0.0, 1e-6);
}

TEST_F(GltfIo, RefusesWhatLies) {
    write_text_file(folder_ / "count.gltf", text("t.bin", 30));
    EXPECT_THROW(read_gltf(folder_ / "count.gltf"), InputError);
    write_text_file(folder_ / "sub/outside.gltf", text("../t.bin"));
    EXPECT_THROW(read_gltf(folder_ / "sub/outside.gltf"), InputError);
    write_text_file(folder_ / "damaged.gltf", text().substr(0, 200));
    EXPECT_THROW(read_gltf(folder_ / "damaged.gltf"), InputError);
    write_text_file(folder_ / "short.glb", "glTF");
    EXPECT_THROW(read_gltf(folder_ / "short.glb"), InputError);
}

}  // namespace
}  // namespace vitrine
