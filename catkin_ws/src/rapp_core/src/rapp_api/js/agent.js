// The skeleton of every dynamic agent (paper Fig. 3): s1 and s5 are the same for all, s2 to s4 are the author's.
"use strict";

/**
 * Derive from it, override `execute`, and where needed the others; each may give a promise. Export the class.
 *
 * `parameters` are those of package.json. The core agent ends a RApp whose event loop stands still too long (10 s).
 */
class DynamicAgent {
  #tell = () => {};

  constructor(parameters = {}) {
    this.parameters = parameters;
  }

  /** s2: prepare what the task needs. */
  initialise() {}

  /** s3: the task. */
  execute() {}

  /** s4: tidy up; also called after a failure. */
  terminate() {}

  /** Stop what this agent has started elsewhere; the core agent waits for the end of it (deliverable section 3.2). */
  dismantle() {}

  /** Let time pass. */
  pause(seconds) {
    return new Promise((resolve) => setTimeout(resolve, seconds * 1000));
  }

  /** Do a part of the task as a state of its own, which `./rapp trace` and the run's report show; gives what `work` gives. */
  state(name, work, label = "") {
    return step(this.#tell, "execute", name, label, work);
  }

  /** Walk the agent's FSM to its end; an error in s2 or s3 leads to s4, and is reported by s5. Called once, by the runner. */
  async run(openChannel, sendTerminate, tell) {
    this.#tell = tell;
    let problem = null;
    const doing = (name, label, work) => step(tell, "dynamic", name, label, work);
    try {
      await doing("s1", "open channel", openChannel);
      await doing("s2", "initialise", () => this.initialise());
      await doing("s3", "execute", () => this.state("execute", () => this.execute()));
    } catch (error) {
      problem = error;
    }
    try {
      await doing("s4", "terminate", () => this.terminate());
    } catch (error) {
      problem ??= error;
    }
    await doing("s5", "send terminate", () => sendTerminate(problem));
  }
}

async function step(tell, machine, state, label, work) {
  tell({ machine, state, kind: "entered", detail: label });
  try {
    return await work();
  } catch (error) {
    tell({ machine, state, kind: "failed", detail: words(error) });
    throw error;
  } finally {
    tell({ machine, state, kind: "left", detail: "" });
  }
}

/** An error as it is reported. */
function words(error) {
  return error instanceof Error ? `${error.name}: ${error.message}` : `Error: ${error}`;
}

module.exports = { DynamicAgent, words };
