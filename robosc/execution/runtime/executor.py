"""
The executor of a controller.

It issues the requests itself, on top of what all executors do.
"""

from __future__ import annotations

from typing import Optional, Union

from robosc.execution.runtime.clock import Clock
from robosc.execution.runtime.decision import make_policy, Policy
from robosc.execution.runtime.event_log import EventLog
from robosc.execution.runtime.protocol import ControlledSystem, Middleware
from robosc.execution.runtime.requests import PolicyDecisions, StrategyDecisions
from robosc.execution.runtime.runner import Runner
from robosc.execution.runtime.safe_stop import describe_error
from robosc.execution.runtime.settings import Settings


class Executor(Runner):
    """
    Executor that runs a controlled system as the robot's controller.

    :param system: Plants, requirements and supervisor with their state.
    :param middleware: Middleware of the robot.
    :param settings: Settings that the deployment chose; the defaults if None.
    :param clock: The only source of time; the computer's if None.
    :param log: The event log; none if None.
    :raises DeploymentError: The model has actions and the supervisor was made for a supervision
        layer.
    :raises SettingsError: A setting is wrong, or names what the model does not have.
    """

    def __init__(
        self,
        system: ControlledSystem,
        middleware: Middleware,
        settings: Optional[Settings] = None,
        clock: Optional[Clock] = None,
        log: Optional[EventLog] = None,
    ) -> None:
        super().__init__(system, middleware, 'controller', settings, clock, log)
        if self.settings.policy is None:
            policy = 'strategy' if system.description.has_strategy else 'fair'
            self.settings = self.settings._replace(policy=policy)
        self._request_names = [request.name for request in self._requests]
        parts = (
            system,
            middleware,
            self._requests,
            self._steps,
            self._recorder,
            self._releases,
            self._calls,
            self._goals,
        )
        self._decisions: Union[PolicyDecisions, StrategyDecisions]
        if self.settings.policy == 'strategy' and self._progress is not None:
            self._progress.is_followed = True
            self._decisions = StrategyDecisions(*parts)
            self._decisions.progress = self._progress
        else:
            self._decisions = PolicyDecisions(*parts)
        self._decides_after_batch = self.settings.every == 'event'

    def tick(self) -> None:
        """Let a period pass: one decision."""
        # This and `receive` are written out for speed: the cycle time of the controller.
        if not self._is_started:
            return
        try:
            now = self._now_s = self._recorder.began_s = self._clock.monotonic()
            if now >= self._deadline_s:
                self._check_time(now)
            if self._may_request:
                if self._decisions.decide(now):
                    self._wake_at(self._replies.deadline_s())
            else:
                self._safe_stop.retry()
        except Exception as error:
            self._fail(describe_error(error))

    def _begin(self) -> None:
        if isinstance(self._decisions, PolicyDecisions):
            self._decisions.begin(self._new_policy())
        super()._begin()

    def _end_batch(self) -> None:
        """Silent steps, and a decision if each batch brings one."""
        self._steps.settle()
        if self._decides_after_batch and self._may_request and self._decisions.decide(self._now_s):
            self._wake_at(self._replies.deadline_s())

    def _new_policy(self) -> Policy:
        settings = self.settings
        return make_policy(
            settings.policy or 'fair', self._request_names, settings.priority, settings.seed
        )
