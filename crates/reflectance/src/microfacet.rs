//! Microfacet terms shared by models: distributions `d_*`, shadowing `g_*` and `v_*`, Fresnel `f_*`.
