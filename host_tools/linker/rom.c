/* What the module in flash stands on (rom.py writes the rest behind it): the VM's layouts, and objects of classes whose names are fixed. */

#include "py/bc.h"
#include "py/builtin.h"
#include "py/objfun.h"
#include "py/objstr.h"
#include "py/objtuple.h"
#include "py/objtype.h"
#include "py/runtime.h"

_Static_assert(MICROPY_QSTR_BYTES_IN_HASH == 2, "the tables are laid out by this hash");

#define ROM_FUNCTION(defaults) static const struct {mp_obj_fun_bc_t code; mp_rom_obj_t of[defaults];}
#define ROM_TABLE(used, table) {{&mp_type_dict}, {1, 1, 0, used, MP_ARRAY_SIZE(table), (mp_map_elem_t *)(void *)table}}

extern const mp_module_context_t tvslam_module;
extern const mp_obj_module_t mp_module_gc, mp_module_micropython;

/* `attributes` places are enough for good: a dict that grows would leave a third of itself empty, and its smaller selves behind. */
static mp_obj_t rom_make(const mp_obj_type_t *type, size_t attributes, size_t n_args, size_t n_kw, const mp_obj_t *args) {
    mp_obj_instance_t *self = mp_obj_malloc_var(mp_obj_instance_t, subobj, mp_obj_t, 0, type);
    mp_map_init(&self->members, attributes);
    mp_map_t *names = &MP_OBJ_TYPE_GET_SLOT(type, locals_dict)->map;
    mp_map_elem_t *init = mp_map_lookup(names, MP_OBJ_NEW_QSTR(MP_QSTR___init__), MP_MAP_LOOKUP);
    if (init) {
        mp_obj_t all[1 + n_args + 2 * n_kw];
        all[0] = MP_OBJ_FROM_PTR(self);
        memcpy(all + 1, args, sizeof(mp_obj_t) * (n_args + 2 * n_kw));
        mp_call_function_n_kw(init->value, n_args + 1, n_kw, all);
    } else {
        mp_arg_check_num(n_args, n_kw, 0, 0, false);
    }
    return MP_OBJ_FROM_PTR(self);
}

/* 1 for each name that a class has: an object's own are looked up first otherwise, so that nearly every look finds. */
extern const byte rom_of_class[];
extern const size_t rom_of_class_size;

static void rom_attr(mp_obj_t self_in, qstr attr, mp_obj_t *dest) {
    mp_obj_instance_t *self = MP_OBJ_TO_PTR(self_in);
    if (dest[0] == MP_OBJ_NULL) {
        mp_map_t *names = &MP_OBJ_TYPE_GET_SLOT(self->base.type, locals_dict)->map;
        bool of_class = attr < rom_of_class_size && rom_of_class[attr];
        for (int i = 0; i < 2; ++i, of_class = !of_class) {
            mp_map_elem_t *found = mp_map_lookup(of_class ? names : &self->members, MP_OBJ_NEW_QSTR(attr), MP_MAP_LOOKUP);
            if (found) {
                if (of_class) {
                    mp_convert_member_lookup(self_in, self->base.type, found->value, dest);
                } else {
                    dest[0] = found->value;
                }
                return;
            }
        }
    } else if (dest[1] != MP_OBJ_NULL) {
        mp_map_lookup(&self->members, MP_OBJ_NEW_QSTR(attr), MP_MAP_LOOKUP_ADD_IF_NOT_FOUND)->value = dest[1];
        dest[0] = MP_OBJ_NULL;
    }
}

#define ROM_CLASS(name, attributes) \
    static mp_obj_t rom_make_tvslam_##name(const mp_obj_type_t *type, size_t n_args, size_t n_kw, const mp_obj_t *args) { \
        return rom_make(type, attributes, n_args, n_kw, args); \
    } \
    static MP_DEFINE_CONST_OBJ_TYPE(rom_tvslam_##name, MP_QSTR_##name, \
    MP_TYPE_FLAG_EQ_NOT_REFLEXIVE | MP_TYPE_FLAG_EQ_CHECKS_OTHER_TYPE | MP_TYPE_FLAG_EQ_HAS_NEQ_TEST \
    | MP_TYPE_FLAG_ITER_IS_GETITER | MP_TYPE_FLAG_INSTANCE_TYPE, \
    make_new, rom_make_tvslam_##name, attr, rom_attr, locals_dict, &rom_names_tvslam_##name);
