/* Behaviour when received data leaves an enum to its default although an earlier rule was unknown. */
typedef enum {
    ROBOT_ON_UNKNOWN_DEFAULT, /* the event happens with that value */
    ROBOT_ON_UNKNOWN_KEEP,    /* the message's event does not happen, as if nothing had come */
    ROBOT_ON_UNKNOWN_FAULT    /* safe stop, for a skipped update too */
} robot_on_unknown_t;

#if !ROBOT_IS_LAYER
typedef enum {
    ROBOT_POLICY_FAIR,     /* newly enabled first, then the longest-ago issued */
    ROBOT_POLICY_PRIORITY, /* a list, then fair */
#if ROBOT_HAS_STRATEGY
    ROBOT_POLICY_RANDOM,   /* splitmix64 from `seed`: not the sequence of the Python executor */
    ROBOT_POLICY_STRATEGY  /* what reaches the goals of the model, and nothing else */
#else
    ROBOT_POLICY_RANDOM    /* splitmix64 from `seed`: not the sequence of the Python executor */
#endif
} robot_policy_t;

#endif
typedef enum {
    ROBOT_STATUS_NEW,      /* not started */
    ROBOT_STATUS_WAITING,  /* for the first message of every sensor with a maximum age, or the end of old goals */
    ROBOT_STATUS_RUNNING,
    ROBOT_STATUS_STOPPING, /* at rest; the ends of cancelled goals are awaited */
    ROBOT_STATUS_STOPPED
} robot_status_t;

typedef enum {
    ROBOT_FAULT_NONE,
    ROBOT_FAULT_CALLBACK,       /* a callback returned false */
    ROBOT_FAULT_ENDLESS,        /* silent steps do not end */
    ROBOT_FAULT_UNKNOWN,        /* something was unknown, and `on_unknown` is a fault */
    ROBOT_FAULT_REFUSED,        /* an event is enabled, but the state does not accept it */
    ROBOT_FAULT_CANCEL_REFUSED, /* the cancel of a running goal was refused */
    ROBOT_FAULT_CALLER          /* `robot_stop` with is_fault */
} robot_fault_t;

/* Kinds of entries reported to the `log` callback, and the argument of each. */
typedef enum {
    ROBOT_LOG_EVENT,      /* an event was taken: the event */
    ROBOT_LOG_UNEXPECTED, /* the event that the state does not accept; ROBOT_NO_EVENT: a reply to nothing */
    ROBOT_LOG_UNKNOWN,    /* something was unknown at this event, or the data of this request was */
#if ROBOT_LIMIT_COUNT > 0
    ROBOT_LOG_LIMITED,    /* numbers of this request were moved into the bounds of limits: its event */
#endif
    ROBOT_LOG_RELEASE,    /* the default message went out: the topic */
    ROBOT_LOG_FAULT,      /* the robot_fault_t */
    ROBOT_LOG_STOP,       /* the communication that is stale, or -1: `robot_stop` */
    ROBOT_LOG_RESUME,     /* the communication that is fresh again */
    ROBOT_LOG_CANCELLING, /* the action whose goal is to be cancelled; `robot_cancelling` says why */
    ROBOT_LOG_CANCEL_OVERDUE, /* the action whose goal has not ended within `cancel_timeout_us` since then */
#if ROBOT_IS_LAYER
    ROBOT_LOG_RESTART,    /* -1 */
    ROBOT_LOG_BLOCKED     /* something of the caller was held back: the robot_refusal_t */
#else
#if ROBOT_HAS_STRATEGY
    ROBOT_LOG_RESTART,    /* -1 */
    ROBOT_LOG_REACHED,    /* the aim that has become true, from 0 on */
    ROBOT_LOG_APPROACH,   /* the aim that is approached now; -1: all of them are met */
    ROBOT_LOG_OWED,       /* the assumption that has been owed for `assumption_timeout_us`, from 0 on */
    ROBOT_LOG_MET         /* the assumption that is met, after that was reported */
#else
    ROBOT_LOG_RESTART     /* -1 */
#endif
#endif
} robot_log_t;
#if ROBOT_ACTION_COUNT > 0

/* Outcome of a goal that did not succeed. */
typedef enum {
    ROBOT_OUTCOME_REJECTED,  /* refused by its server */
    ROBOT_OUTCOME_ABORTED,   /* given up by its server */
    ROBOT_OUTCOME_CANCELLED, /* by whomever; what it moved is at rest */
    ROBOT_OUTCOME_LOST       /* its server is gone */
} robot_outcome_t;

/* Reason why a goal is to be cancelled. */
typedef enum {
    ROBOT_CANCEL_NONE,        /* it is not */
    ROBOT_CANCEL_REQUIREMENT, /* a requirement that held since its request no longer holds */
#if ROBOT_IS_LAYER
    ROBOT_CANCEL_CALLER,      /* its caller cancels it */
#endif
    ROBOT_CANCEL_TIMEOUT,     /* it has not ended within `action_timeout_us` */
    ROBOT_CANCEL_STOP         /* the robot comes to rest */
} robot_cancel_t;
#endif
#if ROBOT_IS_LAYER

/* Reason why something that the caller sent was held back. */
typedef enum {
    ROBOT_REFUSAL_NOT_ALLOWED,   /* by the supervisor, in this state */
    ROBOT_REFUSAL_NOT_FINITE,    /* a NaN or an infinity is in it */
    ROBOT_REFUSAL_NOT_KNOWN,     /* it is no request of the model */
#if ROBOT_LIMIT_COUNT > 0
    ROBOT_REFUSAL_NOT_WITHIN,    /* no number is within all limits */
#endif
    ROBOT_REFUSAL_STILL_RUNNING, /* the last goal of the action may still be under way */
    ROBOT_REFUSAL_NOT_STARTED,
    ROBOT_REFUSAL_WAITING,       /* for the first message of a sensor with a maximum age */
    ROBOT_REFUSAL_OLD_GOALS,     /* from before a restart, which have not ended */
    ROBOT_REFUSAL_OLD_CALLS,     /* from before a restart, which have not been answered */
    ROBOT_REFUSAL_STOPPED,
    ROBOT_REFUSAL_FAULT          /* something failed while it was let through; the robot is stopped now */
} robot_refusal_t;

/* Outcome, for the caller, of a goal that was accepted. */
typedef enum {
    ROBOT_END_SUCCEEDED,
    ROBOT_END_ABORTED,
    ROBOT_END_CANCELLED
} robot_end_t;

#if ROBOT_ACTION_COUNT > 0

/* Reason why a goal that its caller did not cancel has ended as aborted for it. */
typedef enum {
    ROBOT_ABORT_REJECTED,  /* its server refused it */
    ROBOT_ABORT_ABORTED,   /* its server gave it up */
    ROBOT_ABORT_CANCELLED, /* somebody else cancelled it */
    ROBOT_ABORT_LOST,      /* its server is gone */
    ROBOT_ABORT_TURNED,    /* the supervisor cancelled it: a requirement no longer holds */
    ROBOT_ABORT_STOP,      /* it was cancelled, because the robot came to rest */
    ROBOT_ABORT_FAILED     /* it took too long, or the layer began anew */
} robot_abort_t;
#endif

/* Message, request or goal that the caller sent. It is needed until the function that takes it returns. All zero is
   held back. */
typedef struct {
    const void *message; /* the message itself, for the callback that sends it on; the layer does not look at it */
    bool is_finite;      /* there is no NaN and no infinity in it, nor in fields that the model does not know */
    bool is_default;     /* all of it but a header is zero, false or empty; looked at for messages, and for `when: default` */
} robot_sent_t;
#endif

/* Settings of a deployment; begin with `robot_default_settings`. All spans are microseconds. */
typedef struct {
#if !ROBOT_IS_LAYER
    robot_policy_t policy;
    robot_communication_t priority[ROBOT_REQUEST_COUNT + 1]; /* most urgent first, for ROBOT_POLICY_PRIORITY */
    int priority_count;
    uint64_t seed;                                        /* for ROBOT_POLICY_RANDOM */
    bool decides_after_batch;                             /* decide after each batch and each period */
#endif
    robot_on_unknown_t on_unknown;
    uint64_t service_timeout_us;                          /* UINT64_MAX: none */
    uint64_t action_timeout_us;                           /* UINT64_MAX: none; not while a goal is being cancelled */
    uint64_t cancel_timeout_us;                           /* 0: never; a cancel that takes longer is reported */
#if ROBOT_IS_LAYER
    uint64_t command_timeout_us;                          /* 0: never; what acts is released if nothing came */
#endif
#if ROBOT_HAS_STRATEGY
    uint64_t assumption_timeout_us;                       /* 0: never; an assumption owed for so long is reported */
#endif
    uint64_t max_age_us[ROBOT_COMMUNICATION_COUNT + 1];   /* by outgoing message; 0: it is not watched */
    bool releases[ROBOT_TOPIC_COUNT + 1];                 /* by topic: whether its last message keeps acting */
} robot_settings_t;

#if ROBOT_IS_LAYER
/* Callbacks by which the layer sends to the robot and the caller. None of them may call the layer back. Those that
   return a bool return false if they failed, which is a fault. A `message` is what a function below was given,
   unchanged. */
typedef struct {
    void *context; /* first argument of all */

    /* The robot's side. */
#if ROBOT_LIMIT_COUNT > 0
    /* A number is moved into the bounds of limits: write it into what was sent, before that goes out. */
    bool (*set_number)(void *context, const void *message, robot_number_t number, double value);
#endif
    bool (*publish)(void *context, robot_topic_t topic, const void *message);
    bool (*publish_default)(void *context, robot_topic_t topic); /* the all-default message */
    bool (*call)(void *context, uint32_t id, robot_communication_t service, const void *message);
    bool (*send_goal)(void *context, uint32_t id, robot_communication_t action, const void *message);
    bool (*cancel_goal)(void *context, robot_communication_t action, uint32_t id);

    /* The caller's side; `caller_id` is its own number of a call or goal. */
    bool (*pass_on)(void *context, robot_source_t source, const void *message); /* message from the robot */
    bool (*blocked)(void *context, const char *identifier, robot_refusal_t why); /* something was held back */
    bool (*answer)(void *context, robot_communication_t service, uint32_t caller_id, const void *message);
    bool (*answer_default)(void *context, robot_communication_t service, uint32_t caller_id);
    bool (*accept_goal)(void *context, robot_communication_t action, uint32_t caller_id); /* one end follows */
    bool (*reject_goal)(void *context, robot_communication_t action, uint32_t caller_id);
    bool (*pass_feedback)(void *context, robot_communication_t action, uint32_t caller_id, const void *message);
    bool (*end_goal)(void *context, robot_communication_t action, uint32_t caller_id, robot_end_t end,
                     const void *message); /* NULL: the default result */

    void (*log)(void *context, robot_log_t kind, int what); /* NULL: nothing is logged */
} robot_callbacks_t;
#else
/* Callbacks by which the executor asks something of the world. None of them may call the executor back. Those that
   return a bool return false if they failed, which is a fault. */
typedef struct {
    void *context;                                                                   /* first argument of all */
    bool (*publish)(void *context, const robot_request_t *request);
    bool (*publish_default)(void *context, robot_topic_t topic);                      /* the all-default message */
    bool (*call)(void *context, uint32_t id, const robot_request_t *request);         /* call a service */
    bool (*send_goal)(void *context, uint32_t id, const robot_request_t *request);
    bool (*cancel_goal)(void *context, robot_communication_t action, uint32_t id);
    bool (*fits)(void *context, const robot_request_t *request);                      /* NULL: all data fits */
    void (*log)(void *context, robot_log_t kind, int what);                           /* NULL: nothing is logged */
} robot_callbacks_t;
#endif

/* Number of times that something went wrong: one for each entry of that kind in the log. */
typedef struct {
    uint32_t unknown;
    uint32_t unexpected;
    uint32_t faults;
#if ROBOT_LIMIT_COUNT > 0
    uint32_t limited; /* numbers */
#endif
} robot_counters_t;

#if ROBOT_HAS_STRATEGY
/* State of an aim or an assumption, as of the last stable state. */
typedef struct {
    const char *name;  /* such as "goal 1" */
    const char *words; /* as a user writes it */
    const char *mission; /* name of the mission that it is a visit of, or NULL */
    bool is_met;       /* a visit: it was made in this round */
    bool is_unmet;     /* not met; a visit: it is to be made now; neither is true before the start */
    bool is_overdue;   /* an assumption that has been reported as owed for too long */
    uint32_t count;    /* how often it has become met since the start; a visit: was made */
    uint64_t unmet_us; /* since when it is not met */
} robot_standing_t;

/* State of a mission, as of the last stable state. */
typedef struct {
    const char *name;
    int visit;       /* number of the visit that it is at, from 1 on; 0: it is not asked for */
    bool is_round;   /* every visit is true, so that none is left to be made */
    uint32_t rounds; /* how often its last visit was made since the start */
    int detours;     /* number of detours that it has */
} robot_mission_t;

typedef struct {
    uint32_t count;
    uint64_t since_us;
} robot_item_t;

#endif
#if ROBOT_SET_COUNT > 0
#if ROBOT_IS_SMALL
/* Set of numbers below 32: a bit for each. */
typedef uint32_t robot_set_t;
#else
/* Set of numbers: the bit of each, and of each word of these that is not zero. Large sets have wide words, so that few
   of these are gone through. */
#if ROBOT_SET_COUNT > 1024
typedef uint64_t robot_word_t;
enum { ROBOT_WORD_BITS = 64 };
#else
typedef uint32_t robot_word_t;
enum { ROBOT_WORD_BITS = 32 };
#endif
typedef struct {
    robot_word_t used[(ROBOT_SET_COUNT / ROBOT_WORD_BITS + ROBOT_WORD_BITS) / ROBOT_WORD_BITS];
    robot_word_t bits[ROBOT_SET_COUNT / ROBOT_WORD_BITS + 1];
} robot_set_t;
#endif

#endif
typedef struct {
    int request; /* -1: nothing acts */
    uint64_t sent;
    bool was_enabled;
    bool is_due;
#if !ROBOT_IS_LAYER
    bool is_waiting;
#endif
    bool held[ROBOT_CONJUNCT_COUNT + 1];
#if ROBOT_LIMIT_COUNT > 0
    double numbers[ROBOT_NUMBER_COUNT];
#endif
} robot_acting_t;

typedef struct {
    bool is_open;
    bool is_old; /* it is of before a restart: nothing is requested until it is over */
    uint32_t id;
    uint64_t deadline_us;
#if ROBOT_IS_LAYER
    bool is_awaited; /* by the caller */
    uint32_t caller_id;
#endif
} robot_call_t;

#if ROBOT_ACTION_COUNT > 0
/* Cancel of a goal whose end is not known. */
typedef struct {
    robot_cancel_t why;
    bool turned[ROBOT_REQUIREMENT_COUNT + 1]; /* the requirements that no longer hold, in source order */
    bool is_overdue;                          /* it has been reported that the goal did not end in time */
    bool is_old;                              /* it is of before a restart: nothing is requested until it has ended */
    uint64_t asked_us;                        /* time since which it is to be cancelled */
} robot_cancelling_t;

typedef struct {
    bool is_open;
    bool is_running;
    bool is_accepted;
    bool is_cancel_sent;
    robot_cancelling_t cancelling;
    uint32_t id;
    uint64_t deadline_us;
#if ROBOT_IS_LAYER
    bool is_awaited; /* by the caller */
    bool is_cancelled_by_caller;
    uint32_t caller_id;
    robot_abort_t abort;
#endif
    bool held[ROBOT_REQUIREMENT_COUNT + 1];
} robot_goal_t;
#endif

typedef struct {
    uint64_t seen_us;
    bool was_seen;
    bool is_stale;
} robot_sensor_t;

#if ROBOT_IS_LAYER
/* The layer. `state` and `counters` may be read at any time; the rest is its own business. */
#else
/* The executor. `state` and `counters` may be read at any time; the rest is its own business. */
#endif
typedef struct {
    robot_state_t state;
    robot_counters_t counters;
    robot_settings_t settings;
    robot_callbacks_t callbacks;
    bool is_stable; /* no silent step is enabled in this state, and what follows from it was done */
#if ROBOT_STALE_COUNT > 0
    robot_set_t stale; /* silent steps, then requests, that may be allowed now or no longer */
#endif
    bool is_pending;
    bool is_started;
    bool is_stopped;
    bool may_request;
#if !ROBOT_IS_LAYER
    bool is_new;
#endif
    robot_fault_t fault;
    robot_fault_t why;
    uint64_t now_us;
    uint64_t deadline_us;
    uint64_t awaited_until_us;
#if !ROBOT_IS_LAYER
    uint64_t random;
#endif
    uint64_t sent_count;
    uint32_t next_call_id;
    uint32_t next_goal_id;
#if !ROBOT_IS_LAYER
#if ROBOT_REQUEST_COUNT > 0
    int64_t decision;
    int64_t favoured[ROBOT_REQUEST_COUNT]; /* the decision at which a request was last issued for being new */
#if ROBOT_IS_SMALL
    int64_t turns[ROBOT_REQUEST_COUNT];    /* by request: the one with the least goes first */
    robot_set_t candidates; /* requests that may be issued */
#else
    int32_t turns[ROBOT_REQUEST_COUNT];    /* by request: the one with the least goes first */
    int32_t owners[2 * ROBOT_REQUEST_COUNT]; /* the request that has each turn, or -1 */
    int next_turn;
    int listed_count;       /* number of requests in the list of the policy `priority`, which have the first turns */
    robot_set_t candidates; /* turns of the requests that may be issued */
#endif
    robot_set_t fresh;      /* those of them that could not be at the last decision */
    robot_set_t withheld;   /* those that turned out at this decision to have no data, or unfit */
    robot_set_t unchanging; /* requests that were issued in this stable state and changed nothing */
#endif
#else
    uint64_t arrived_us[ROBOT_TOPIC_COUNT + 1];
#endif
#if ROBOT_HAS_STRATEGY
    robot_item_t items[ROBOT_AIM_COUNT + ROBOT_ASSUMPTION_COUNT];
    uint32_t seen[(ROBOT_AIM_COUNT + ROBOT_ASSUMPTION_COUNT + ROBOT_VISIT_COUNT + ROBOT_MISSION_COUNT + 31) / 32];
    uint32_t reported[(ROBOT_AIM_COUNT + ROBOT_ASSUMPTION_COUNT + 31) / 32];
    bool has_observed;
    bool is_choice_known; /* the strategy was asked in this stable state */
    int approached;
    int chosen;
    int candidate;
#endif
    robot_acting_t acting[ROBOT_TOPIC_COUNT + 1];
#if ROBOT_TOPIC_COUNT > 0
    robot_set_t acting_topics; /* those where something acts */
#if !ROBOT_IS_LAYER
    int waiting_count; /* number of those where a release waits */
#endif
#endif
#if ROBOT_LIMIT_COUNT > 0
    double numbers[ROBOT_NUMBER_COUNT]; /* of the request under way */
    int moved;
#endif
    bool is_restless[ROBOT_TOPIC_COUNT + 1];
    robot_call_t calls[ROBOT_SERVICE_COUNT + 1];
#if ROBOT_ACTION_COUNT > 0
    robot_goal_t goals[ROBOT_ACTION_COUNT];
    robot_set_t open_goals; /* actions with a goal that has not ended */
#endif
    robot_sensor_t sensors[ROBOT_SENSOR_COUNT + 1];
} robot_t;

/* The default settings of this model. */
void robot_default_settings(robot_settings_t *settings);

/* Begin with everything in the initial state; NULL settings are the default ones. False if a setting is wrong or a
   callback that the model needs is missing; it must not be used then. */
bool robot_init(robot_t *r, const robot_settings_t *settings, const robot_callbacks_t *callbacks);

/* The argument `now_us` of all functions below is the time since some moment, in microseconds; it
   never goes back. */

/* Begin; what comes earlier is ignored. Does nothing the second time. */
void robot_start(robot_t *r, uint64_t now_us);

#if ROBOT_IS_LAYER
/* Time has passed: stale sensors, a caller that fell silent, replies that did not come, messages and cancels still
   owed. Call it at least every 100 ms. */
#else
/* A period has passed: one decision. */
void robot_tick(robot_t *r, uint64_t now_us);

/* Time has passed, but no period: stale sensors, replies that did not come, messages and cancels still owed. */
#endif
void robot_watch(robot_t *r, uint64_t now_us);

/* Come to rest until `robot_restart`; is_fault says whether the program found a fault. */
void robot_stop(robot_t *r, uint64_t now_us, bool is_fault);

/* Begin again in the initial state, whatever happened. Nothing is requested before the goals under way have ended. */
void robot_restart(robot_t *r, uint64_t now_us);

robot_status_t robot_status(const robot_t *r, uint64_t now_us);

/* The fault that stopped it, or ROBOT_FAULT_NONE. */
robot_fault_t robot_fault(const robot_t *r);

/* Return true if a controllable event is allowed now; false for an event of the environment. */
bool robot_enabled(const robot_t *r, robot_event_t event);

#if ROBOT_HAS_STRATEGY
/* State of an aim of the strategy, or of an assumption. `number`: the aims from 0 on, then the assumptions. */
robot_standing_t robot_standing(const robot_t *r, int number, uint64_t now_us);

/* State of a mission. */
robot_mission_t robot_mission(const robot_t *r, int number);

/* Number of the visit that a detour of a mission is at, from 1 on; 0: it is idle. `number`: from 0 on. */
int robot_detour(const robot_t *r, int mission, int number);

/* The aim that the last decision approached; -1: all were met, or another policy decides. */
int robot_approached(const robot_t *r);

/* The communication that the strategy chose at the last decision; -1: it waits, or another policy decides. */
int robot_chosen(const robot_t *r);

#endif
/* Names as the model has them; NULL for a number that is none. */
const char *robot_event_name(int event);
const char *robot_communication_name(int communication);
const char *robot_topic_name(int topic);
#if ROBOT_IS_LAYER
const char *robot_source_name(int source);
#if ROBOT_LIMIT_COUNT > 0
const char *robot_number_name(int number); /* of the request and its property: "drive: linear.x" */
#endif
#endif
#if ROBOT_SERVICE_COUNT > 0

/* A service call will not be answered: its server is absent or lost, or refuses it. */
void robot_call_failed(robot_t *r, uint64_t now_us, uint32_t id);

/* Return true if a call of a service from before a restart is not over: nothing is requested until it is. */
bool robot_is_call_old(const robot_t *r, robot_communication_t service);
#endif
#if ROBOT_ACTION_COUNT > 0

/* A goal was accepted by its server. */
void robot_goal_accepted(robot_t *r, uint64_t now_us, uint32_t id);

#if ROBOT_IS_LAYER
/* A goal ended without success. `message`: its result for the caller, or NULL. */
void robot_goal_ended(robot_t *r, uint64_t now_us, uint32_t id, robot_outcome_t outcome, const void *message);
#else
/* A goal ended without success. One that is being cancelled is executed until its end is reported. */
void robot_goal_ended(robot_t *r, uint64_t now_us, uint32_t id, robot_outcome_t outcome);
#endif

/* A cancel was refused: whether because the goal had ended already. */
void robot_cancel_refused(robot_t *r, uint64_t now_us, uint32_t id, bool has_ended);

/* Cancel of the goal of an action that is under way, if there is one and it is to be cancelled. */
robot_cancelling_t robot_cancelling(const robot_t *r, robot_communication_t action);
#if ROBOT_IS_LAYER

/* Reason why the last goal of an action that has ended as aborted for its caller did so; `end_goal` may ask for it. */
robot_abort_t robot_abort_reason(const robot_t *r, robot_communication_t action);
#endif
#endif
