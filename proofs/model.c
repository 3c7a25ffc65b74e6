// Runs a harness of the crate, translated to C, in a model checker. A trap is what must not happen: a claim that does not
// hold, a panic, an access beyond the memory.
#include "proofs.c"

static u8 bytes[1 << 15];

bool wasm_rt_is_initialized(void) { return true; }

void wasm_rt_allocate_memory(wasm_rt_memory_t *memory, u32 pages, u32 most) {
  __CPROVER_assert(pages == 1, "one page is enough");
  memory->data = bytes;
  memory->pages = pages;
  memory->max_pages = most;
  memory->size = sizeof(bytes);
}

void wasm_rt_allocate_funcref_table(wasm_rt_funcref_table_t *table, u32 elements, u32 most) {
  static wasm_rt_funcref_t functions[64];
  __CPROVER_assert(elements <= 64, "room for each function");
  table->data = functions;
  table->size = elements;
  table->max_size = most;
}

u32 wasm_rt_register_func_type(u32 parameters, u32 results, ...) {
  static u32 types;
  return ++types;
}

void wasm_rt_trap(wasm_rt_trap_t code) {
  __CPROVER_assert(0, "no trap");
  __CPROVER_assume(0);
}

u32 nondet_any(void);

u32 Z_envZ_any_u32(struct Z_env_instance_t *nobody) { return nondet_any(); }

void Z_envZ_assume(struct Z_env_instance_t *nobody, u32 holds) { __CPROVER_assume(holds); }

int main(void) {
  static Z_proofs_instance_t instance;
  Z_proofs_init_module();
  Z_proofs_instantiate(&instance, 0);
  HARNESS(&instance);
  return 0;
}
