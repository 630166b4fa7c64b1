#include "scene/scene.h"

#include "base/file.h"
#include "geometry/mesh_io.h"
#include "geometry/primitives.h"
#include "scene/insertion.h"

#include <gtest/gtest.h>

#include <unistd.h>

namespace vitrine {
namespace {

namespace fs = std::filesystem;

class SceneFile : public testing::Test {
  protected:
    fs::path folder_ = fs::temp_directory_path() / ("vitrine_scene_" + std::to_string(::getpid()));
    void SetUp() override { fs::create_directories(folder_); }
    void TearDown() override { fs::remove_all(folder_); }
    std::string error_of(const std::string& text) {
        write_text_file(folder_ / "bad.json", text);
        try {
            read_scene(folder_ / "bad.json");
        } catch (const InputError& error) {
            return error.what();
        }
        return "no error";
    }
};

TEST_F(SceneFile, RoundTripKeepsEveryKind) {
    Scene scene;
    scene.cameras.push_back(
        {"c0", 64, 48, 50, 51, 31.5, 23.5, Rigid3{Mat3::Identity(), Vec3(-1, -1, -1)}});
    const auto mesh = std::make_shared<Mesh>(make_sphere(0.1, Vec3(0, 0, 0.1), 8));
    scene.parts.push_back(
        {"a", mesh, Diffuse{Rgb(0.1f, 0.2f, 0.3f), nullptr, "", false}, "", false});
    scene.parts.push_back(
        {"b", mesh, Ward{Rgb(0.1f, 0.1f, 0.1f), Rgb(0.2f, 0.2f, 0.2f), 0.1, 0.2, WardForm::Duer},
         "", false});
    scene.parts.push_back({"c", mesh, Mirror{}, "", false});
    scene.parts.push_back({"d", mesh, Dielectric{1.45, Rgb(1, 2, 3)}, "", false});
    scene.lights = {PointLight{Vec3(1, 2, 3), Rgb(1, 2, 3)}, DiscLight{}, SpotLight{},
                    DirectionalLight{}};
    scene.ambient_radiance = Rgb(0.1f, 0.2f, 0.3f);
    write_scene(folder_ / "s.json", scene);
    const Scene back = read_scene(folder_ / "s.json");
    write_scene(folder_ / "t" / "s.json", back);
    EXPECT_EQ(read_text_file(folder_ / "s.json"), read_text_file(folder_ / "t" / "s.json"));
    EXPECT_EQ(std::get<Dielectric>(back.parts[3].material).ior, 1.45);
    EXPECT_LT((back.cameras[0].centre_in_world() - Vec3(1, 1, 1)).norm(), 1e-9);
}

TEST_F(SceneFile, MistakesSayWhatAndWhere) {
    EXPECT_NE(error_of("{\"schema\": \"vitrine.scene/1\", \"cameras\": [], \"parts\": [],\n"
                       " \"ligths\": []}")
                  .find("\"lights\""),
              std::string::npos);
    EXPECT_NE(error_of("{\"schema\": \"vitrine.scene/1\", \"cameras\": [], \"lights\": [],\n"
                       " \"parts\": [{\"name\": \"x\", \"mesh\": \"../x.ply\", \"material\": {}}]}")
                  .find("within the folder"),
              std::string::npos);
    EXPECT_NE(error_of("{\"schema\": \"vitrine.scene/1\", \"cameras\": [], \"parts\": [],\n"
                       " \"lights\": [{\"kind\": \"dics\"}]}")
                  .find("Did you mean \"disc\"?"),
              std::string::npos);
}

TEST_F(SceneFile, InsertionPlacesTheMesh) {
    write_ply(folder_ / "hat.ply", make_sphere(0.1, Vec3::Zero(), 8));
    write_text_file(folder_ / "i.json",
                    R"({"schema": "vitrine.insertion/1", "objects": [{"mesh": "hat.ply",
                    "to_world": [1,0,0,1, 0,1,0,2, 0,0,1,3, 0,0,0,1],
                    "material": {"kind": "dielectric", "ior": 1.5}}], "frames": "all"})");
    const Insertion insertion = read_insertion(folder_ / "i.json");
    EXPECT_LT((bounds(*insertion.objects[0].mesh).centre() - Vec3(1, 2, 3)).norm(), 1e-6);
    EXPECT_TRUE(insertion.objects[0].is_virtual);
    EXPECT_TRUE(insertion.frames.empty());
    Mesh open = make_sphere(0.1, Vec3::Zero(), 8);
    open.triangles.pop_back();
    write_ply(folder_ / "hat.ply", open);
    try {
        read_insertion(folder_ / "i.json");
        FAIL();
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("3 open"), std::string::npos) << error.what();
    }
    write_text_file(folder_ / "j.json",
                    R"({"schema": "vitrine.insertion/1", "objects": [{"mesh": "gone.obj"}]})");
    EXPECT_THROW(read_insertion(folder_ / "j.json"), InputError);
}

}  // namespace
}  // namespace vitrine
