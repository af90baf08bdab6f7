//! The table of sources that rows cite: one line per publication, its constant named as its key is.

use super::Source;

/// Constants of [`Source`], and the list of them all.
macro_rules! sources {
    ($($name:ident = $key:literal: $authors:literal, $title:literal, $venue:literal, $year:literal;)*) => {
        $(
            #[doc = concat!($authors, ": ", $title)]
            pub const $name: Source = Source { key: $key, authors: $authors, title: $title, venue: $venue, year: $year };
        )*
        /// All of them, ordered by key.
        pub const ALL: &[Source] = &[$($name),*];
    };
}

sources! {
    AILA_LAINE_2009 = "aila-laine-2009": "T. Aila, S. Laine", "Understanding the Efficiency of Ray Traversal on GPUs", "HPG", 2009;
    ANDERSSON_2020 = "andersson-2020": "P. Andersson, J. Nilsson, T. Akenine-Möller, M. Oskarsson, K. Åström, M. Fairchild", "FLIP: A Difference Evaluator for Alternating Images", "HPG", 2020;
    APETREI_2014 = "apetrei-2014": "C. Apetrei", "Fast and Simple Agglomerative LBVH Construction", "EG UK CGVC", 2014;
    ASHKIANI_2016 = "ashkiani-2016": "S. Ashkiani, A. Davidson, U. Meyer, J. Owens", "GPU Multisplit", "PPoPP", 2016;
    BECKMANN_SPIZZICHINO_1963 = "beckmann-spizzichino-1963": "P. Beckmann, A. Spizzichino", "The Scattering of Electromagnetic Waves from Rough Surfaces", "Pergamon Press", 1963;
    BELLMAN_1961 = "bellman-1961": "R. Bellman", "On the Approximation of Curves by Line Segments Using Dynamic Programming", "CACM 4(6)", 1961;
    BLASI_1993 = "blasi-1993": "P. Blasi, B. Le Saëc, C. Schlick", "A Rendering Algorithm for Discrete Volume Density Objects", "CGF 12(3)", 1993;
    BLELLOCH_1990 = "blelloch-1990": "G. Blelloch", "Prefix Sums and Their Applications", "CMU-CS-90-190", 1990;
    BLINN_1977 = "blinn-1977": "J. Blinn", "Models of Light Reflection for Computer Synthesized Pictures", "SIGGRAPH", 1977;
    BLINN_NEWELL_1976 = "blinn-newell-1976": "J. Blinn, M. Newell", "Texture and Reflection in Computer Generated Images", "CACM 19(10)", 1976;
    BORN_WOLF_1999 = "born-wolf-1999": "M. Born, E. Wolf", "Principles of Optics, 7th edition", "Cambridge University Press", 1999;
    BURLEY_2020 = "burley-2020": "B. Burley", "Practical Hash-based Owen Scrambling", "JCGT 10(4)", 2020;
    CHANDRASEKHAR_1960 = "chandrasekhar-1960": "S. Chandrasekhar", "Radiative Transfer", "Dover", 1960;
    CIGOLLE_2014 = "cigolle-2014": "Z. Cigolle et al.", "A Survey of Efficient Representations for Independent Unit Vectors", "JCGT 3(2)", 2014;
    CLARBERG_2008 = "clarberg-2008": "P. Clarberg", "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD", "JGT 13(3)", 2008;
    COLEMAN_1968 = "coleman-1968": "W. Coleman", "Mathematical Verification of a Certain Monte Carlo Sampling Technique", "Nuclear Science and Engineering 32", 1968;
    CONTY_KULLA_2018 = "conty-kulla-2018": "A. Conty Estevez, C. Kulla", "Importance Sampling of Many Lights with Adaptive Tree Splitting", "PACMCGIT 1(2) (HPG)", 2018;
    COOK_TORRANCE_1982 = "cook-torrance-1982": "R. Cook, K. Torrance", "A Reflectance Model for Computer Graphics", "ACM TOG 1(1)", 1982;
    CORNELL_BOX_DATA = "cornell-box-data": "Cornell University Program of Computer Graphics", "Cornell Box Data", "graphics.cornell.edu/online/box/data.html", 0;
    CROW_1984 = "crow-1984": "F. Crow", "Summed-Area Tables for Texture Mapping", "SIGGRAPH", 1984;
    DEERING_1988 = "deering-1988": "M. Deering et al.", "The Triangle Processor and Normal Vector Shader", "SIGGRAPH", 1988;
    DEKKER_1971 = "dekker-1971": "T. J. Dekker", "A Floating-Point Technique for Extending the Available Precision", "Numerische Mathematik 18", 1971;
    DOMINGUES_PEDRINI_2015 = "domingues-pedrini-2015": "L. Domingues, H. Pedrini", "Bounding Volume Hierarchy Optimization through Agglomerative Treelet Restructuring", "HPG", 2015;
    DOTSENKO_2008 = "dotsenko-2008": "Y. Dotsenko, N. Govindaraju, P.-P. Sloan, C. Boyd, J. Manferdelli", "Fast Scan Algorithms on Graphics Processors", "ICS", 2008;
    DUPUY_BENYOUB_2023 = "dupuy-benyoub-2023": "J. Dupuy, A. Benyoub", "Sampling Visible GGX Normals with Spherical Caps", "HPG", 2023;
    ENDERTON_2010 = "enderton-2010": "E. Enderton, E. Sintorn, P. Shirley, D. Luebke", "Stochastic Transparency", "I3D", 2010;
    ENGELHARDT_2013 = "engelhardt-2013": "T. Engelhardt", "Efficient From-Point Visibility for Global Illumination in Virtual Scenes with Participating Media", "PhD thesis, KIT", 2013;
    ENGELHARDT_DACHSBACHER_2008 = "engelhardt-dachsbacher-2008": "T. Engelhardt, C. Dachsbacher", "Octahedron Environment Maps", "VMV", 2008;
    FABIANOWSKI_2011 = "fabianowski-2011": "B. Fabianowski", "Interactive Manycore Photon Mapping", "PhD thesis, Trinity College Dublin", 2011;
    FEYNMAN_1964 = "feynman-1964": "R. Feynman, R. Leighton, M. Sands", "The Feynman Lectures on Physics", "Addison-Wesley", 1964;
    FOLEY_SUGERMAN_2005 = "foley-sugerman-2005": "T. Foley, J. Sugerman", "KD-Tree Acceleration Structures for a GPU Raytracer", "Graphics Hardware", 2005;
    GANESTAM_2015 = "ganestam-2015": "P. Ganestam, R. Barringer, M. Doggett, T. Akenine-Möller", "Bonsai: Rapid Bounding Volume Hierarchy Generation using Mini Trees", "JCGT 4(3)", 2015;
    GERASIMOV_2004 = "gerasimov-2004": "P. Gerasimov", "Omnidirectional Shadow Mapping", "GPU Gems", 2004;
    GORAL_1984 = "goral-1984": "C. Goral, K. Torrance, D. Greenberg, B. Battaile", "Modeling the Interaction of Light Between Diffuse Surfaces", "SIGGRAPH", 1984;
    GREENE_1986 = "greene-1986": "N. Greene", "Environment Mapping and Other Applications of World Projections", "IEEE CG&A 6(11)", 1986;
    GULBRANDSEN_2014 = "gulbrandsen-2014": "O. Gulbrandsen", "Artist Friendly Metallic Fresnel", "JCGT 3(4)", 2014;
    HACHISUKA_JENSEN_2009 = "hachisuka-jensen-2009": "T. Hachisuka, H. W. Jensen", "Stochastic Progressive Photon Mapping", "ACM TOG 28(5)", 2009;
    HAGEMANN_1975 = "hagemann-1975": "H.-J. Hagemann, W. Gudat, C. Kunz", "Optical Constants from the Far Infrared to the X-Ray Region: Mg, Al, Cu, Ag, Au, Bi, C, and Al2O3", "J. Opt. Soc. Am. 65", 1975;
    HAINES_1987 = "haines-1987": "E. Haines", "A Proposal for Standard Graphics Environments", "IEEE CG&A 7(11)", 1987;
    HAINES_2019 = "haines-2019": "E. Haines et al.", "Precision Improvements for Ray/Sphere Intersection", "Ray Tracing Gems, chapter 7", 2019;
    HECKBERT_1990 = "heckbert-1990": "P. Heckbert", "Adaptive Radiosity Textures for Bidirectional Ray Tracing", "SIGGRAPH", 1990;
    HEIDRICH_SEIDEL_1998 = "heidrich-seidel-1998": "W. Heidrich, H.-P. Seidel", "View-Independent Environment Maps", "Graphics Hardware", 1998;
    HEITZ_2014 = "heitz-2014": "E. Heitz", "Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs", "JCGT 3(2)", 2014;
    HENYEY_GREENSTEIN_1941 = "henyey-greenstein-1941": "L. Henyey, J. Greenstein", "Diffuse Radiation in the Galaxy", "ApJ 93", 1941;
    HOER_LOVE_1965 = "hoer-love-1965": "C. Hoer, C. Love", "Exact Inductance Equations for Rectangular Conductors", "J. Res. NBS 69C", 1965;
    HOFFMAN_2019 = "hoffman-2019": "N. Hoffman", "Fresnel Equations Considered Harmful", "Eurographics Workshop on Material Appearance Modeling", 2019;
    HOLBERT_2011 = "holbert-2011": "D. Holbert", "Saying Goodbye to Shadow Acne", "GDC", 2011;
    HORN_2007 = "horn-2007": "D. Horn, J. Sugerman, M. Houston, P. Hanrahan", "Interactive k-D Tree GPU Raytracing", "I3D", 2007;
    IEC_61966_2_1 = "iec-61966-2-1": "IEC", "61966-2-1: Default RGB Colour Space, sRGB", "", 1999;
    IGEHY_1999 = "igehy-1999": "H. Igehy", "Tracing Ray Differentials", "SIGGRAPH", 1999;
    IZE_2013 = "ize-2013": "T. Ize", "Robust BVH Ray Traversal", "JCGT 2(2)", 2013;
    JARZYNSKI_OLANO_2020 = "jarzynski-olano-2020": "M. Jarzynski, M. Olano", "Hash Functions for GPU Rendering", "JCGT 9(3)", 2020;
    JENSEN_1996 = "jensen-1996": "H. W. Jensen", "Global Illumination using Photon Maps", "EGWR", 1996;
    JENSEN_2001 = "jensen-2001": "H. W. Jensen", "Realistic Image Synthesis Using Photon Mapping", "A K Peters", 2001;
    JENSEN_CHRISTENSEN_1998 = "jensen-christensen-1998": "H. W. Jensen, P. Christensen", "Efficient Simulation of Light Transport in Scenes with Participating Media Using Photon Maps", "SIGGRAPH", 1998;
    JOHNSON_CHRISTY_1972 = "johnson-christy-1972": "P. B. Johnson, R. W. Christy", "Optical Constants of the Noble Metals", "Phys. Rev. B 6", 1972;
    JOHNSON_CHRISTY_1974 = "johnson-christy-1974": "P. B. Johnson, R. W. Christy", "Optical Constants of Transition Metals", "Phys. Rev. B 9", 1974;
    JOLDES_2017 = "joldes-2017": "M. Joldes, J.-M. Muller, V. Popescu", "Tight and Rigorous Error Bounds for Basic Building Blocks of Double-Word Arithmetic", "ACM TOMS 44", 2017;
    KAJIYA_1986 = "kajiya-1986": "J. Kajiya", "The Rendering Equation", "SIGGRAPH", 1986;
    KARIS_2013 = "karis-2013": "B. Karis", "Real Shading in Unreal Engine 4", "SIGGRAPH course notes", 2013;
    KARLIK_2019 = "karlik-2019": "O. Karlík, M. Šik, P. Vévoda, T. Skřivan, J. Křivánek", "MIS Compensation: Optimizing Sampling Techniques in Multiple Importance Sampling", "ACM TOG 38(6)", 2019;
    KARRAS_2012 = "karras-2012": "T. Karras", "Maximizing Parallelism in the Construction of BVHs, Octrees, and k-d Trees", "HPG", 2012;
    KAUTZ_2000 = "kautz-2000": "J. Kautz, P.-P. Vázquez, W. Heidrich, H.-P. Seidel", "A Unified Approach to Prefiltered Environment Maps", "EGWR", 2000;
    KAY_KAJIYA_1986 = "kay-kajiya-1986": "T. Kay, J. Kajiya", "Ray Tracing Complex Scenes", "SIGGRAPH", 1986;
    KELEMEN_SZIRMAY_KALOS_2001 = "kelemen-szirmay-kalos-2001": "C. Kelemen, L. Szirmay-Kalos", "A Microfacet Based Coupled Specular-Matte BRDF Model", "Eurographics short papers", 2001;
    KHRONOS_GLTF = "khronos-gltf": "Khronos", "glTF 2.0 Specification", "", 0;
    KHRONOS_LIGHTS_PUNCTUAL = "khronos-lights-punctual": "Khronos", "KHR_lights_punctual", "glTF extension", 0;
    KHRONOS_MATERIALS_VOLUME = "khronos-materials-volume": "Khronos", "KHR_materials_volume", "glTF extension", 0;
    KHRONOS_RAY_QUERY = "khronos-ray-query": "Khronos", "GLSL_EXT_ray_query", "GLSL extension", 0;
    KHRONOS_SPIRV = "khronos-spirv": "Khronos", "SPIR-V Specification", "", 0;
    KHRONOS_VULKAN = "khronos-vulkan": "Khronos", "Vulkan 1.3 Specification", "", 0;
    KIRK_ARVO_1991 = "kirk-arvo-1991": "D. Kirk, J. Arvo", "Unbiased Sampling Techniques for Image Synthesis", "SIGGRAPH", 1991;
    KNAUS_ZWICKER_2011 = "knaus-zwicker-2011": "C. Knaus, M. Zwicker", "Progressive Photon Mapping: A Probabilistic Approach", "ACM TOG 30(3)", 2011;
    KULLA_CONTY_2017 = "kulla-conty-2017": "C. Kulla, A. Conty", "Revisiting Physically Based Shading at Imageworks", "SIGGRAPH course notes", 2017;
    KULLA_FAJARDO_2012 = "kulla-fajardo-2012": "C. Kulla, M. Fajardo", "Importance Sampling Techniques for Path Tracing in Participating Media", "EGSR", 2012;
    KUTZ_2021 = "kutz-2021": "P. Kutz, M. Hašan, M. Edmondson", "Novel Aspects of the Adobe Standard Material", "Adobe technical report", 2021;
    LAFORTUNE_WILLEMS_1994 = "lafortune-willems-1994": "E. Lafortune, Y. Willems", "Using the Modified Phong Reflectance Model for Physically Based Rendering", "Report CW 197, KU Leuven", 1994;
    LAINE_2010 = "laine-2010": "S. Laine", "Restart Trail for Stackless BVH Traversal", "HPG", 2010;
    LAINE_2013 = "laine-2013": "S. Laine, T. Karras, T. Aila", "Megakernels Considered Harmful: Wavefront Path Tracing on GPUs", "HPG", 2013;
    LAINE_KARRAS_2011 = "laine-karras-2011": "S. Laine, T. Karras", "Stratified Sampling for Stochastic Transparency", "EGSR", 2011;
    LAMBERT_1760 = "lambert-1760": "J. H. Lambert", "Photometria", "", 1760;
    LAUTERBACH_2009 = "lauterbach-2009": "C. Lauterbach et al.", "Fast BVH Construction on GPUs", "Eurographics", 2009;
    LAZANYI_SZIRMAY_KALOS_2005 = "lazanyi-szirmay-kalos-2005": "I. Lazányi, L. Szirmay-Kalos", "Fresnel Term Approximations for Metals", "WSCG short papers", 2005;
    MEISTER_BITTNER_2018 = "meister-bittner-2018": "D. Meister, J. Bittner", "Parallel Reinsertion for Bounding Volume Hierarchy Optimization", "CGF 37(2)", 2018;
    MEYER_2010 = "meyer-2010": "Q. Meyer et al.", "On Floating-Point Normal Vectors", "EGSR", 2010;
    MIKKELSEN_2008 = "mikkelsen-2008": "M. S. Mikkelsen", "Simulation of Wrinkled Surfaces Revisited", "Master's thesis, University of Copenhagen", 2008;
    MILLER_2019 = "miller-2019": "B. Miller, I. Georgiev, W. Jarosz", "A Null-scattering Path Integral Formulation of Light Transport", "SIGGRAPH", 2019;
    MILLER_HOFFMAN_1984 = "miller-hoffman-1984": "G. Miller, C. R. Hoffman", "Illumination and Reflection Maps", "SIGGRAPH course notes", 1984;
    MOLLER_TRUMBORE_1997 = "moller-trumbore-1997": "T. Möller, B. Trumbore", "Fast, Minimum Storage Ray/Triangle Intersection", "JGT 2(1)", 1997;
    NEYMAN_1934 = "neyman-1934": "J. Neyman", "On the Two Different Aspects of the Representative Method", "Journal of the Royal Statistical Society 97(4)", 1934;
    NOVAK_2014 = "novak-2014": "J. Novák, A. Selle, W. Jarosz", "Residual Ratio Tracking for Estimating Attenuation in Participating Media", "SIGGRAPH Asia", 2014;
    NUSSELT_1928 = "nusselt-1928": "W. Nusselt", "Graphische Bestimmung des Winkelverhältnisses bei der Wärmestrahlung", "Zeitschrift des VDI 72", 1928;
    OPENEXR = "openexr": "Academy Software Foundation", "Technical Introduction to OpenEXR", "", 0;
    OWEN_1995 = "owen-1995": "A. Owen", "Randomly Permuted (t,m,s)-Nets and (t,s)-Sequences", "Monte Carlo and Quasi-Monte Carlo Methods in Scientific Computing", 1995;
    PANTALEONI_LUEBKE_2010 = "pantaleoni-luebke-2010": "J. Pantaleoni, D. Luebke", "HLBVH: Hierarchical LBVH Construction for Real-Time Ray Tracing of Dynamic Geometry", "HPG", 2010;
    PHARR_2016 = "pharr-2016": "M. Pharr, W. Jakob, G. Humphreys", "Physically Based Rendering, 3rd edition", "Morgan Kaufmann", 2016;
    PHARR_2023 = "pharr-2023": "M. Pharr, W. Jakob, G. Humphreys", "Physically Based Rendering, 4th edition", "MIT Press", 2023;
    PRAUN_HOPPE_2003 = "praun-hoppe-2003": "E. Praun, H. Hoppe", "Spherical Parametrization and Remeshing", "SIGGRAPH", 2003;
    RAKIC_1995 = "rakic-1995": "A. D. Rakić", "Algorithm for the Determination of Intrinsic Optical Constants of Metal Films: Application to Aluminum", "Appl. Opt. 34", 1995;
    RAMAMOORTHI_HANRAHAN_2001 = "ramamoorthi-hanrahan-2001": "R. Ramamoorthi, P. Hanrahan", "An Efficient Representation for Irradiance Environment Maps", "SIGGRAPH", 2001;
    RITSCHEL_2008 = "ritschel-2008": "T. Ritschel et al.", "Imperfect Shadow Maps for Efficient Computation of Indirect Illumination", "SIGGRAPH Asia", 2008;
    ROUSSELLE_2011 = "rousselle-2011": "F. Rousselle, C. Knaus, M. Zwicker", "Adaptive Sampling and Reconstruction using Greedy Error Minimization", "SIGGRAPH Asia", 2011;
    SAITO_TAKAHASHI_1990 = "saito-takahashi-1990": "T. Saito, T. Takahashi", "Comprehensible Rendering of 3-D Shapes", "SIGGRAPH", 1990;
    SATISH_2009 = "satish-2009": "N. Satish, M. Harris, M. Garland", "Designing Efficient Sorting Algorithms for Manycore GPUs", "IPDPS", 2009;
    SCHJOTH_2007 = "schjoth-2007": "L. Schjøth, J. Frisvad, K. Erleben, J. Sporring", "Photon Differentials", "GRAPHITE", 2007;
    SCHLICK_1994 = "schlick-1994": "C. Schlick", "An Inexpensive BRDF Model for Physically-based Rendering", "Eurographics", 1994;
    SENGUPTA_2007 = "sengupta-2007": "S. Sengupta, M. Harris, Y. Zhang, J. Owens", "Scan Primitives for GPU Computing", "Graphics Hardware", 2007;
    SHIRLEY_1996 = "shirley-1996": "P. Shirley, C. Wang, K. Zimmerman", "Monte Carlo Techniques for Direct Lighting Calculations", "ACM TOG 15(1)", 1996;
    SHIRLEY_1997 = "shirley-1997": "P. Shirley et al.", "A Practitioners' Assessment of Light Reflection Models", "Pacific Graphics", 1997;
    SIDAK_1967 = "sidak-1967": "Z. Šidák", "Rectangular Confidence Regions for the Means of Multivariate Normal Distributions", "JASA 62", 1967;
    SILVERMAN_1986 = "silverman-1986": "B. Silverman", "Density Estimation for Statistics and Data Analysis", "Chapman and Hall", 1986;
    SUBR_ARVO_2007 = "subr-arvo-2007": "K. Subr, J. Arvo", "Statistical Hypothesis Testing for Assessing Monte Carlo Estimators", "Pacific Graphics", 2007;
    SUYKENS_WILLEMS_2001 = "suykens-willems-2001": "F. Suykens, Y. Willems", "Path Differentials and Applications", "EGWR", 2001;
    TURK_1994 = "turk-1994": "G. Turk", "The PLY Polygon File Format", "", 1994;
    VEACH_1997 = "veach-1997": "E. Veach", "Robust Monte Carlo Methods for Light Transport Simulation", "PhD thesis, Stanford University", 1997;
    WALD_2004 = "wald-2004": "I. Wald", "Realtime Ray Tracing and Interactive Global Illumination", "PhD thesis, Saarland University", 2004;
    WALD_2007 = "wald-2007": "I. Wald", "On fast Construction of SAH-based Bounding Volume Hierarchies", "IEEE RT", 2007;
    WALD_GUENTHER_2004 = "wald-guenther-2004": "I. Wald, J. Günther, P. Slusallek", "Balancing Considered Harmful: Faster Photon Mapping using the Voxel Volume Heuristic", "Eurographics", 2004;
    WALD_HAVRAN_2006 = "wald-havran-2006": "I. Wald, V. Havran", "On building fast kd-Trees for Ray Tracing, and on doing that in O(N log N)", "IEEE RT", 2006;
    WALTER_2005 = "walter-2005": "B. Walter et al.", "Lightcuts: A Scalable Approach to Illumination", "SIGGRAPH", 2005;
    WALTER_2007 = "walter-2007": "B. Walter, S. Marschner, H. Li, K. Torrance", "Microfacet Models for Refraction through Rough Surfaces", "EGSR", 2007;
    WARD_1991 = "ward-1991": "G. Ward", "Real Pixels", "Graphics Gems II", 1991;
    WAVEFRONT_OBJ = "wavefront-obj": "Wavefront", "OBJ and MTL", "", 0;
    WILKIE_2014 = "wilkie-2014": "A. Wilkie et al.", "Hero Wavelength Spectral Sampling", "EGSR", 2014;
    WILLIAMS_1978 = "williams-1978": "L. Williams", "Casting Curved Shadows on Curved Surfaces", "SIGGRAPH", 1978;
    WONG_2010 = "wong-2010": "H. Wong et al.", "Demystifying GPU Microarchitecture through Microbenchmarking", "ISPASS", 2010;
    WOODCOCK_1965 = "woodcock-1965": "E. Woodcock et al.", "Techniques Used in the GEM Code for Monte Carlo Neutronics Calculations", "ANL-7050", 1965;
    WOOP_2013 = "woop-2013": "S. Woop, C. Benthin, I. Wald", "Watertight Ray/Triangle Intersection", "JCGT 2(1)", 2013;
    YLITIE_2017 = "ylitie-2017": "H. Ylitie, T. Karras, S. Laine", "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", "HPG", 2017;
    ZHUKOV_1998 = "zhukov-1998": "S. Zhukov, A. Iones, G. Kronin", "An Ambient Light Illumination Model", "EGWR", 1998;
}
