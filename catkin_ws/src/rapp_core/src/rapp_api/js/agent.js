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

  /**
   * Walk the agent's FSM to its end; an error leads to s4, and is reported by s5. Called once, by the runner.
   *
   * `failed` is a promise that rejects with what fails where nobody waits for it.
   */
  async run(openChannel, sendTerminate, tell, failed = new Promise(() => {})) {
    this.#tell = tell;
    let problem = null;
    const doing = (name, label, work) => step(tell, "dynamic", name, label, work);
    const task = async () => {
      await doing("s1", "open channel", openChannel);
      await doing("s2", "initialise", () => this.initialise());
      await doing("s3", "execute", () => this.state("execute", () => this.execute()));
    };
    try {
      await Promise.race([task(), failed]);
    } catch (error) {
      problem = reason(error);
    }
    try {
      const tidied = doing("s4", "terminate", () => this.terminate());
      await (problem ? tidied : Promise.race([tidied, failed]));
    } catch (error) {
      problem ??= reason(error);
    }
    await doing("s5", "send terminate", () => sendTerminate(problem));
  }
}

/** What was thrown; an error of its own where it was nothing, such as `reject()`. */
function reason(error) {
  return error || new Error(`${error} was thrown`);
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

module.exports = { DynamicAgent, reason, words };
