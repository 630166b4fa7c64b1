// The canonical scene for POV-Ray 3.7 (its y is our z: left-handed axes are swapped below).
// Photons are aimed at the glass sphere alone. Declare Count on the command line.
#version 3.7;
#ifndef (Count) #declare Count = 100000; #end
global_settings {
    assumed_gamma 1.0
    max_trace_level 24
    photons { count Count media 0 autostop 0 }
}
camera {
    perspective
    location <-0.0, 0.6, 0.9>
    look_at <0, 0, 0>
    right x * image_width / image_height
    angle 2 * degrees(atan(0.5 * 640 / 553.9830366915456))
}
light_source { <0.55, 0.8, -0.45> color rgb 1 fade_distance 1e-4 fade_power 2
               photons { reflection on refraction on } }
box { <-0.6, -0.001, -0.6>, <0.6, 0, 0.6> pigment { rgb 0.6 } finish { diffuse 1 ambient 0 }
      photons { collect on } }
box { <0.15, 0, 0.1>, <0.25, 0.1, 0.2> pigment { rgb <0.6, 0.1, 0.1> } finish { diffuse 1 ambient 0 }
      photons { collect on } }
sphere { <0, 0.061, 0>, 0.06
    pigment { rgbt 1 }
    finish { diffuse 0 ambient 0 reflection { 0, 1 fresnel on } conserve_energy }
    interior { ior 1.5 }
    photons { target 1.0 reflection on refraction on collect off }
}
